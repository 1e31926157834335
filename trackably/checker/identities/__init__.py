"""Formulas that are equal as functions: rational arithmetic with polynomials, roots and sines."""
