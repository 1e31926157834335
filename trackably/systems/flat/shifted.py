"""The former place of `trackably.systems.trajectories`."""

from trackably.systems.trajectories import one_of, shifted

__all__ = ["one_of", "shifted"]
