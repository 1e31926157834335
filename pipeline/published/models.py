"""Nonlinear systems by name, for params.yaml: each is a function in ordinary arithmetic."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from trackable.systems.nonlinear import Nonlinear

_TANK_SAMPLING = 5.0
_AREA, _OUTLET = 2.0, 0.05


def tank(x: Sequence[Any], u: Sequence[Any]) -> list[Any]:
    """The level [m] of a tank of 2 m² after 5 s of an inflow [m³/s], by Euler's method; it empties after Torricelli."""
    (level,), (inflow,) = x, u
    return [level + _TANK_SAMPLING / _AREA * (inflow - _OUTLET * np.sqrt(level))]


MODELS: dict[str, Nonlinear] = {"tank": Nonlinear.of(tank, ["level"], ["inflow"])}
