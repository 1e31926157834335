"""Stationary kernels: one file a family; sums and products of them."""
