"""The former place of `trackably.systems.polytopes`."""

from trackably.systems.polytopes import Interval, ends_shown, rounded

__all__ = ["Interval", "ends_shown", "rounded"]
