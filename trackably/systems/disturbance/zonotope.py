"""The former place of `trackably.systems.disturbances`."""

from trackably.systems.disturbances import Zonotope

__all__ = ["Zonotope"]
