"""The former place of `trackably.systems.polytopes`."""

from trackably.systems.polytopes import Polytope

__all__ = ["Polytope"]
