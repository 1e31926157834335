"""The former place of `trackably.systems.trajectories`."""

from trackably.systems.trajectories import Quantity

__all__ = ["Quantity"]
