"""The former place of `trackably.cached`."""

from trackably.cached import T, cached

__all__ = ["T", "cached"]
