"""Trajectories that others made: certified, refuted or repaired."""
