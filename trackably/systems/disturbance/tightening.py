"""The former place of `trackably.systems.tightening`."""

from trackably.systems.tightening import Tightening, tightening

__all__ = ["Tightening", "tightening"]
