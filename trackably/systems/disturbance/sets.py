"""The former place of `trackably.systems.disturbances`."""

from trackably.systems.disturbances import DisturbanceSet, checked

__all__ = ["DisturbanceSet", "checked"]
