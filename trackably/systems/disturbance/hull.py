"""The former place of `trackably.systems.disturbances`."""

from trackably.systems.disturbances import ConvexHull

__all__ = ["ConvexHull"]
