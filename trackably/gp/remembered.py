"""The former place of `trackably.gp.signal`."""

from trackably.gp.signal import Remembered, RememberedSum

__all__ = ["Remembered", "RememberedSum"]
