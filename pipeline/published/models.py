"""Nonlinear systems by name, for params.yaml. Each is a function in ordinary arithmetic."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from trackable.systems import library
from trackable.systems.nonlinear import Nonlinear

_AREA, _OUTLET = 2.0, 0.05


def tank(sampling_time: float) -> Nonlinear:
    """Return the level [m] of a tank of 2 m² with an inflow [m³/s], by Euler's method; it empties after Torricelli."""

    def successor(x: Sequence[Any], u: Sequence[Any]) -> list[Any]:
        (level,), (inflow,) = x, u
        return [level + sampling_time / _AREA * (inflow - _OUTLET * np.sqrt(level))]

    return Nonlinear.of(successor, ["level"], ["inflow"], sampling_time)


MODELS: Mapping[str, Callable[..., Nonlinear]] = {
    "tank": tank,
    "mobile_robot": library.mobile_robot,
    "kinematic_bicycle": library.kinematic_bicycle,
    "two_tanks": library.two_tanks,
    "pendulum": library.pendulum,
}
"""By name: the system with a sampling time [s], and with parameters of its own."""
