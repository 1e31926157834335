"""Model predictive control that tracks a reference: controllers, and the simulation of their closed loops."""
