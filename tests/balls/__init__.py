"""Formulas in ball arithmetic (python-flint): a second arithmetic to compare with."""
