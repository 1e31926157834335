"""Closed loops of experiments: their disturbances, initial states and metrics."""
