"""Signals that are not learned as sums of kernels: piecewise polynomials."""
