"""The former place of `trackably.systems.trajectories`."""

from trackably.systems.trajectories import Functional, Signals

__all__ = ["Functional", "Signals"]
