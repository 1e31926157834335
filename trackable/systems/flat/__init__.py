"""Flat outputs: states and inputs as functions of the signals that are learned."""
