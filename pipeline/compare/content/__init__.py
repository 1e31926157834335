"""Artifacts as values at places, one module for each kind of file."""
