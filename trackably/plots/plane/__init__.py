"""Figures of two states in their plane: the path of a vehicle, and the loops that return to it."""
