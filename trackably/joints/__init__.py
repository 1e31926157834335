"""Joints: limits that trajectories keep between the points, and a gate for what is streamed to them."""
