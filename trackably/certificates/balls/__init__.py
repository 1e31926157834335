"""Enclosures in ball arithmetic: kernels, formulas, Taylor models."""
