"""Formulas of nonlinear systems: written as Python functions, kept as expressions."""
