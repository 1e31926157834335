"""The former place of `trackably.systems.disturbances`."""

from trackably.systems.disturbances import Measured, measured

__all__ = ["Measured", "measured"]
