"""Interval arithmetic, power series, polynomials and Taylor models."""
