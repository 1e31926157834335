"""The former place of `trackably.systems.tightening`."""

from trackably.systems.tightening import InvariantSet, invariant_set

__all__ = ["InvariantSet", "invariant_set"]
