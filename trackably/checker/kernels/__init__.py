"""Kernels: one class a family, in a file of its own, and one registry of their names."""
