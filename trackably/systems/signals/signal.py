"""The former place of `trackably.systems.pieces`."""

from trackably.systems.pieces import Signal

__all__ = ["Signal"]
