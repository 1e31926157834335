"""Trackable: learn a reference from noisy samples, and guarantee that the controlled system can follow it."""
