"""Joints: limits that trajectories keep between their points, and a gate for streamed motions."""
