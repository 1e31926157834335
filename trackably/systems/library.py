"""Systems that come with the library: vehicles, tanks and a pendulum, as functions of their sampling time.

Angles are in rad, lengths in m, times in s. Vehicles and the pendulum are discretised by Euler steps, unless stated
otherwise; tests compare them with their differential equations.
"""

from collections.abc import Callable, Mapping
from inspect import signature
from types import MappingProxyType
from typing import Any

import numpy as np

from trackably.arguments import positive, real
from trackably.systems.flat_forms import FlatForm
from trackably.systems.nonlinear import NonlinearSystem

GRAVITY = 9.81
"""Acceleration of gravity [m/s²]."""


def mobile_robot(sampling_time: float) -> NonlinearSystem:
    """Return a robot with two driven wheels (the unicycle), discretised by Euler's step.

    ẋ = v cos θ, ẏ = v sin θ, θ̇ = ω: R. Siegwart and I. Nourbakhsh, Introduction to Autonomous Mobile Robots, 2004,
    3.2. States x, y [m], heading θ [rad]; inputs speed v [m/s], turn rate ω [rad/s]. The flat outputs are x and y. They
    determine the heading only while the robot moves: bound its speed from below.

    The step of length h that is exact for constant inputs is not offered, because x and y are not its flat outputs. It
    moves the position by a chord of length s = v h sin(ω h/2)/(ω h/2) in the direction φ = θ + ω h/2, and θ⁺ = 2 φ − θ.
    Positions determine s and φ, but θ(k) then depends on all earlier steps, not on a few shifts of x and y. Other flat
    outputs exist: the heading, and the signed distance of the chord's line from the origin. They determine a position
    as the intersection of the lines of two successive chords. But these lines are parallel when the robot drives
    straight on, so that neither a straight path nor a figure eight could be proved.
    """
    h = _step(sampling_time)
    return _vehicle(h, "turn", lambda speed, turn: turn, lambda way, turned: turned / h)


def kinematic_bicycle(sampling_time: float, wheelbase: float) -> NonlinearSystem:
    """Return a car that steers with its front wheels and does not slip, discretised by Euler's step.

    ẋ = v cos θ, ẏ = v sin θ, θ̇ = v tan δ/L with the `wheelbase` L [m]: P. Polack et al., The kinematic bicycle model:
    A consistent model for planning feasible trajectories for autonomous vehicles?, 2017, with its reference point at
    the rear axle. States x, y [m] of the rear axle, heading θ [rad]; inputs speed v [m/s], steering δ [rad], between
    −π/2 and π/2. The flat outputs are x and y. They determine the heading only while the car moves: bound its speed
    from below.
    """
    h, length = _step(sampling_time), positive("wheelbase", wheelbase)
    return _vehicle(
        h,
        "steering",
        lambda speed, steering: speed * np.tan(steering) / length,
        lambda way, turned: np.arctan(length * turned / way),
    )


def tank(sampling_time: float, area: float = 2.0, outflow: float = 0.6) -> NonlinearSystem:
    """Return a tank that empties through a hole, by Euler's step: A ẋ = u − a √x (Torricelli).

    `area` A [m²], `outflow` a [m^2.5/s]. State level x [m], input inflow u [m³/s].
    """
    return _tanks(["level"], sampling_time, area, outflow)


def two_tanks(sampling_time: float, area: float = 2.0, outflow: float = 0.6) -> NonlinearSystem:
    """Return two equal tanks, the upper of which empties into the lower one, by Euler's step.

    A ẋ₁ = u − a √x₁, A ẋ₂ = a √x₁ − a √x₂ (Torricelli): `area` A [m²], `outflow` a [m^2.5/s]. States upper and lower
    level [m], input inflow u [m³/s]. The flat output is the lower level.
    """
    return _tanks(["upper", "lower"], sampling_time, area, outflow)


def pendulum(sampling_time: float, length: float = 0.5, mass: float = 0.2, friction: float = 0.02) -> NonlinearSystem:
    """Return a pendulum on an actuated joint, by Euler's step: m l² ω̇ = τ − b ω − m g l sin θ, θ̇ = ω.

    A point mass m [kg] on a light rod of `length` l [m], with viscous `friction` b [N m s]. States angle θ [rad], zero
    when hanging, and rate ω [rad/s]; input torque τ [N m]. The flat output is the angle.
    """
    h = _step(sampling_time)
    rod, weight, drag = positive("length", length), positive("mass", mass), real("friction", friction)
    inertia = weight * rod**2

    def f(x: Any, u: Any) -> list[Any]:
        angle, rate = x
        return [angle + h * rate, rate + h / inertia * (u[0] - drag * rate - weight * GRAVITY * rod * np.sin(angle))]

    return NonlinearSystem.of(f, ["angle", "rate"], ["torque"], h)


def _step(sampling_time: float) -> float:
    return positive("system: sampling_time", sampling_time)


def _tanks(levels: list[str], sampling_time: float, area: float, outflow: float) -> NonlinearSystem:
    """Return equal tanks, each of which empties into the next one; `levels` names their states, the uppermost first."""
    h, wide, hole = _step(sampling_time), positive("area", area), positive("outflow", outflow)

    def f(x: Any, u: Any) -> list[Any]:
        flows = [u[0], *(hole * np.sqrt(level) for level in x)]
        return [level + h / wide * (inflow - out) for level, inflow, out in zip(x, flows, flows[1:], strict=False)]

    return NonlinearSystem.of(f, levels, ["inflow"], h)


def _vehicle(h: float, second: str, rate: Callable[..., Any], solved: Callable[..., Any]) -> NonlinearSystem:
    """Return a vehicle that moves in the direction of its heading θ, with the inputs speed v and u₂, named `second`.

    Its heading obeys θ̇ = `rate`(v, u₂); `solved`(h v, θ⁺ − θ) is this equation, after a step of h, solved for u₂.
    """

    def f(state: Any, inputs: Any) -> list[Any]:
        x, y, heading = state
        speed, other = inputs
        turn = rate(speed, other)
        return [x + h * speed * np.cos(heading), y + h * speed * np.sin(heading), heading + h * turn]

    def flat(z: Any) -> tuple[list[Any], list[Any]]:
        (x, y), (x1, y1) = z[1] - z[0], z[2] - z[1]
        way, turned = np.hypot(x, y), np.arctan2(x * y1 - y * x1, x * x1 + y * y1)
        return [*z[0], np.arctan2(y, x)], [way / h, solved(way, turned)]

    return NonlinearSystem.of(f, ["x", "y", "heading"], ["speed", second], h, FlatForm.of(flat, 2, ["heading"]))


MODELS: Mapping[str, Callable[..., NonlinearSystem]] = MappingProxyType(
    {model.__name__: model for model in (tank, mobile_robot, kinematic_bicycle, two_tanks, pendulum)}
)
"""The systems above by the names that files use: functions of the sampling time [s] and of their own parameters."""


def model_of(name: str, sampling_time: float, parameters: Mapping[str, float]) -> NonlinearSystem:
    """Return the system of this name. ValueError: there is none, or the parameters are not those of the system."""
    if name not in MODELS:
        raise ValueError(f"model: there is no model {name!r}; there are {', '.join(MODELS)}")
    try:
        signature(MODELS[name]).bind(sampling_time, **parameters)
    except TypeError as error:
        raise ValueError(f"parameters: expected those of the model {name}, got {dict(parameters)} ({error})") from error
    return MODELS[name](sampling_time, **parameters)
