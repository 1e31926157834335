"""Trajectories from other tools: certified, refuted or repaired."""
