"""The former place of `trackably.systems.trajectories`."""

from trackably.systems.trajectories import Coordinate, Trajectory, combined, single_signal

__all__ = ["Coordinate", "Trajectory", "combined", "single_signal"]
