"""The former place of `trackably.systems.expressions`."""

from trackably.systems.expressions import MAX_DEPTH, from_lists, to_lists

__all__ = ["MAX_DEPTH", "from_lists", "to_lists"]
