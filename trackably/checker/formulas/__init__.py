"""Formulas of a nonlinear system, and their values in several arithmetics."""
