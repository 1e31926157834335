"""Expressions, their algebra, and how Python functions become expressions."""
