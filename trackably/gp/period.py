"""The former place of `trackably.gp.joint`."""

from trackably.gp.joint import common_period, has_period, period_of

__all__ = ["common_period", "has_period", "period_of"]
