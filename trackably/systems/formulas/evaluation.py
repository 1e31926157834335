"""The former place of `trackably.systems.expressions`."""

from trackably.systems.expressions import Arithmetic, V, evaluate, evaluate_floats

__all__ = ["Arithmetic", "V", "evaluate", "evaluate_floats"]
