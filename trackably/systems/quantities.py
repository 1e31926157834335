"""The former place of `trackably.systems.trajectories`."""

from trackably.systems.trajectories import Indices, Quantities

__all__ = ["Indices", "Quantities"]
