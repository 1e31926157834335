"""Nonlinear systems by name, for params.yaml: those that come with the library."""

from collections.abc import Callable, Mapping

from trackable.systems import library
from trackable.systems.nonlinear import Nonlinear

MODELS: Mapping[str, Callable[..., Nonlinear]] = {
    "tank": library.tank,
    "mobile_robot": library.mobile_robot,
    "kinematic_bicycle": library.kinematic_bicycle,
    "two_tanks": library.two_tanks,
    "pendulum": library.pendulum,
}
"""By name: the system with a sampling time [s], and with parameters of its own."""
