"""Searches for plans of a nonlinear system, counted against what is exactly reachable."""
