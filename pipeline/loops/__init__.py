"""Closed loops of experiments: what disturbs them, where they begin, and the numbers that describe them."""
