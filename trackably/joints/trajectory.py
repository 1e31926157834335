"""Trajectories of joints as polynomial pieces: from splines, waypoints, time-optimal planners and ROS 2 messages."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from reprlib import repr as short
from typing import Any, Self

import numpy as np
from numpy.polynomial.polynomial import polyder
from scipy.interpolate import CubicSpline, PPoly
from scipy.special import comb, factorial

from trackably.arguments import array, positive
from trackably.arrays import Array, ArrayLike
from trackably.given.conversion import shift
from trackably.joints.limits import different_names
from trackably.systems.pieces import increasing, is_spline, piece_at, pieces_of_spline

_ACCEPTED = (
    "a spline of SciPy with a column for each joint, a trajectory of Ruckig or of TOPP-RA, or a JointTrajectory, as "
    "JointTrajectory.through(times, positions)"
)
_AT_TARGET = 1e-3  # s; the duration of a motion of Ruckig that begins at its target and takes no time
_OFF = 1e-9  # pieces may differ from a planner's positions by this part of the largest position, or of 1 if larger


@dataclass(frozen=True, eq=False)
class JointTrajectory:
    """Joint j is q_j(t) = Σ_k c_jik (t − t_i)^k for t_i ≤ t ≤ t_(i+1), with `breakpoints` t_i [s], c = `coefficients`.

    `breakpoints` have the shape (K + 1,), and `coefficients` (J, K, degree + 1), with J `names`. The stored float64
    numbers are exact, and q may jump from piece to piece. If it `rests`, all joints stay at their last positions;
    otherwise the trajectory is not defined after its last breakpoint.

    ValueError: shapes do not fit, breakpoints do not increase, a number is not finite, or names repeat.
    """

    names: tuple[str, ...]
    breakpoints: Array
    coefficients: Array
    rests: bool

    def __init__(
        self, names: Sequence[str], breakpoints: ArrayLike, coefficients: ArrayLike, rests: bool = True
    ) -> None:
        known, ends = different_names("trajectory: names", names), increasing("trajectory: times", breakpoints)
        c = array("trajectory: coefficients", coefficients, len(known), len(ends) - 1, None)
        if not isinstance(rests, bool):
            raise TypeError(f"trajectory: rests: expected True or False, got {rests!r}")
        vars(self).update(names=known, breakpoints=ends, coefficients=c, rests=rests)

    @classmethod
    def of(cls, given: Any, names: Sequence[str] | None = None, rests: bool = True) -> Self:
        """Convert a planner's trajectory, for example a spline of SciPy with a column for each joint.

        `given` is such a spline, as `CubicSpline(t, q)` with q of shape (N, J), a `Trajectory` of Ruckig, or the result
        of TOPP-RA's `compute_trajectory`. By default, `names` are q1, q2, …. Proofs are about the float64 coefficients
        of the pieces. If B-splines, Ruckig's profiles or TOPP-RA's constant accelerations are given, these coefficients
        are computed here, with rounding errors.

        TypeError: `given` is none of these. ValueError: a spline does not have one column for each name, or the pieces
        differ from the planner's own values.
        """
        if isinstance(given, JointTrajectory):
            return replace(given, rests=rests)  # type: ignore[return-value]
        given = getattr(given, "cspl", given)  # the spline of SciPy in a trajectory of TOPP-RA
        if hasattr(given, "profiles") and hasattr(given, "at_time"):
            ends, c = _of_ruckig(given)
        elif hasattr(given, "_ss") and hasattr(given, "_velocities"):
            ends, c = _of_toppra(given)
        elif is_spline(given):
            ends, c = _of_spline(given)
        else:
            raise TypeError(f"trajectory: expected {_ACCEPTED}, got {short(given)}")
        known = _known(names, len(c))
        if len(known) != len(c):
            raise ValueError(f"trajectory: expected a column for each of {len(known)} names, got {len(c)}")
        return cls(known, ends, c, rests)

    @classmethod
    def through(
        cls,
        times: ArrayLike,
        positions: ArrayLike,
        velocities: ArrayLike | None = None,
        accelerations: ArrayLike | None = None,
        names: Sequence[str] | None = None,
        upsampled: bool = False,
        rests: bool = True,
    ) -> Self:
        """Return what ROS 2's joint_trajectory_controller interpolates through points at `times` (N,) [s].

        Each field has the shape (N, J). A piece is linear if its points have positions only, cubic if both have
        velocities, and quintic if both have accelerations too. With `upsampled` (the controller's parameter
        positions_upsampling), positions without velocities get those of the cubic spline that begins and ends at rest.
        The controller's formulas are in `Trajectory::interpolate_between_points` and `fill_cubic_spline_velocities`, in
        ros2_controllers, joint_trajectory_controller/src/trajectory.cpp at commit
        94e74de35f9d04f313aca8f29df66c3a76004aa7. Here, the same polynomials are found from their conditions at both
        ends. Rounding errors of the controller's evaluation in float64 are not included.

        ValueError: shapes do not fit, times do not increase, or there are accelerations without velocities (for which
        the controller commands zero positions).
        """
        t = increasing("trajectory: times", times)
        q = array("trajectory: positions", positions, len(t), None)
        given = {"velocities": velocities, "accelerations": accelerations}
        fields = [q, *(array(f"trajectory: {name}", of, *q.shape) for name, of in given.items() if of is not None)]
        if accelerations is not None and velocities is None:
            raise ValueError(
                "trajectory: accelerations need velocities: give velocities= too (for accelerations alone, "
                "joint_trajectory_controller commands zero positions)"
            )
        known = _known(names, q.shape[1])
        if upsampled and len(fields) == 1:
            fields.append(np.asarray(CubicSpline(t, q, bc_type="clamped")(t, 1)))
        ends = np.stack(fields)
        return cls(known, t, hermite(ends[:, :-1], ends[:, 1:], np.diff(t)), rests)

    def __repr__(self) -> str:
        first, last = self.span
        end = "at rest afterwards" if self.rests else "not defined afterwards"
        return (
            f"JointTrajectory({', '.join(self.names)}: {len(self.breakpoints) - 1} pieces of degree {self.degree} from "
            f"{first:.9g} s to {last:.9g} s, {end})"
        )

    @property
    def degree(self) -> int:
        """The degree of the pieces; higher coefficients may be zero."""
        return int(self.coefficients.shape[2]) - 1

    @property
    def span(self) -> tuple[float, float]:
        """The first and the last time [s]."""
        return float(self.breakpoints[0]), float(self.breakpoints[-1])

    def __call__(self, t: ArrayLike, order: int = 0) -> Array:
        """Return positions of all joints, or their derivatives of an order, at t [s]: shape (*t.shape, J).

        At a breakpoint they are those of the piece that begins there. Before the start they are those at the start, and
        after the end those at the end; but derivatives are zero after the end if the trajectory rests.
        """
        curve = PPoly(self.coefficients.transpose(2, 1, 0)[::-1], self.breakpoints)
        found = curve(np.clip(np.asarray(t, dtype=float), *self.span), order)
        if order and self.rests:
            found = np.where(np.asarray(t)[..., None] >= self.span[1], 0.0, found)
        return found

    def state(self, t: ArrayLike, orders: int) -> Array:
        """Return positions and their derivatives below order `orders` at t [s]: shape (orders, *t.shape, J)."""
        return np.stack([self(t, order) for order in range(orders)])

    def at_ends(self, orders: int) -> Array:
        """Return positions and their derivatives below order `orders` at the end of each piece: (orders, K, J)."""
        moved = shift(self.coefficients, np.diff(self.breakpoints))
        return np.stack([polyder(moved, r, axis=2)[:, :, 0].T for r in range(orders)])

    def on(self, ends: Array) -> Self:
        """Return the same motion with the breakpoints `ends` [s]; it rests at times at which it was not defined.

        Its own breakpoints between the first and the last of `ends` must be among `ends`, up to rounding.
        """
        own, middle = self.breakpoints, (ends[:-1] + ends[1:]) / 2
        i = piece_at(own, middle)
        c = shift(self.coefficients[:, i], ends[:-1] - own[i])
        rests = (middle < own[0]) | (middle > own[-1])
        c[:, rests], c[:, rests, 0] = 0.0, self(middle[rests]).T
        return replace(self, breakpoints=ends, coefficients=c)

    def followed_by(self, ends: Array, c: Array) -> Self:
        """Return the motion with further pieces, given by the time at which each ends [s] and by their coefficients."""
        return replace(
            self, breakpoints=np.append(self.breakpoints, ends), coefficients=join([self.coefficients, c], axis=1)
        )

    def slowed(self, factor: float) -> Self:
        """Return the same path with `factor` times the duration, from the same start on.

        ValueError: the factor is not positive.
        """
        s, first = positive("slowed: factor", factor), self.breakpoints[0]
        scaled = self.coefficients / s ** np.arange(float(self.degree + 1))
        return replace(self, breakpoints=first + s * (self.breakpoints - first), coefficients=scaled)


def _known(names: Sequence[str] | None, count: int) -> Sequence[str]:
    return [f"q{j + 1}" for j in range(count)] if names is None else names


def hermite(start: Array, end: Array, widths: Array) -> Array:
    """Return the coefficients of polynomials with given values and derivatives at both ends of pieces: (J, K, 2 R).

    `start` and `end` have the shape (R, K, J), by order of the derivative, and `widths` h (K,) [s]. The result is in
    powers of the time t since the start of a piece, but computed in those of x = t/h: the first R coefficients are
    h^k q^(k)/k! at the start. The other R solve the conditions at x = 1, where the r-th derivative of x^k is r! times
    the binomial coefficient "k choose r".
    """
    R = len(start)
    low, high = slice(R), slice(R, 2 * R)
    powers = (widths ** np.arange(2.0 * R)[:, None])[:, :, None]
    factorials = factorial(np.arange(R))[:, None, None]
    at_end = comb(np.arange(2 * R), np.arange(R)[:, None])
    known, wanted = (of * (powers[low] / factorials) for of in (start, end))
    left = wanted - np.tensordot(at_end[:, low], known, axes=1)
    found = np.tensordot(np.rint(np.linalg.inv(at_end[:, high])), left, axes=1)
    return np.concatenate([start / factorials, found / powers[high]]).T


def _shared_breakpoints(ends: Sequence[Array]) -> Array:
    """Return the breakpoints of all curves [s] in the time that the curves share.

    Breakpoints that agree up to rounding are returned once. ValueError: the curves share no time.
    """
    first, last = max(of[0] for of in ends), min(of[-1] for of in ends)
    if not first < last:
        raise ValueError("trajectory: expected curves of all joints over a common time, got curves without one")
    every, closest = np.unique(np.concatenate(ends)), 1e-9 * (last - first)
    inner = every[(every > first + closest) & (every < last - closest)]
    return np.array([first, *inner[np.diff(inner, prepend=first) > closest], last])


def join(parts: Sequence[Array], axis: int = 0) -> Array:
    """Join pieces (J, K, n) of several degrees into one array, along axis 0 (more joints) or axis 1 (more times)."""
    n = max(part.shape[2] for part in parts)
    return np.concatenate([np.pad(part, ((0, 0), (0, 0), (0, n - part.shape[2]))) for part in parts], axis)


def _of_spline(given: Any) -> tuple[Array, Array]:
    ends, c = pieces_of_spline(given)
    if c.ndim > 3:
        raise ValueError(f"trajectory: expected one value for each joint, got shape {c.shape[2:]}")
    return ends, np.transpose(c.reshape(*c.shape[:2], -1), (2, 1, 0))


def _of_ruckig(given: Any) -> tuple[Array, Array]:
    """Return pieces of constant jerk between the times at which the jerk of some joint changes."""
    if len(given.profiles) != 1:
        raise ValueError("trajectory: a trajectory of Ruckig must have one profile, without intermediate waypoints")
    end = given.duration or _AT_TARGET
    changes = [np.cumsum([0.0, *of.brake.t, *of.t]) for of in given.profiles[0]]
    ends = _shared_breakpoints([np.append(times[times < end], end) for times in changes])
    part = np.diff(ends) / 4
    inside = (np.array([given.at_time(t)[:3] for t in ends[:-1] + k * part]) for k in (1, 3))
    (q, v, a), (_, _, later) = (np.moveaxis(states, 0, 2) for states in inside)
    c = shift(np.stack([q, v, a / 2, (later - a) / (12 * part)], axis=2), -part)
    return _verify(ends, c, lambda t: given.at_time(t)[0], "Ruckig")


def _of_toppra(given: Any) -> tuple[Array, Array]:
    """Return the pieces of q(s(t)), of degree 6: the path q(s) is cubic, and s(t) has constant accelerations."""
    path = getattr(given._path, "cspl", None)
    if path is None:
        raise ValueError(
            f"trajectory: a path of TOPP-RA must be a SplineInterpolator, got {type(given._path).__name__}"
        )
    knots, cubic = _of_spline(path)
    grid, speeds, times = np.array([given._ss, given._velocities, given._ts])[
        :, np.append(True, np.diff(given._ts) > 0)
    ]
    s = _shared_breakpoints([grid, knots])
    i = piece_at(grid, s)
    v = np.sqrt(np.interp(s, grid, speeds**2))  # at constant acceleration, the square of the speed is linear in s
    t = times[i] + 2 * (s - grid[i]) / np.maximum(speeds[i] + v, np.finfo(float).tiny)
    path = JointTrajectory(_known(None, len(cubic)), knots, cubic).on(s).coefficients
    half = np.diff(v) / np.diff(t) / 2
    c = np.zeros((*path.shape[:2], 2 * path.shape[2] - 1))
    for power in reversed(range(path.shape[2])):  # Horner's rule with s = v t + a t²/2, where a/2 is `half`
        moved = v[:-1, None] * c[:, :, :-1]
        moved[:, :, 1:] += half[:, None] * c[:, :, :-2]
        c[:, :, 0], c[:, :, 1:] = path[:, :, power], moved
    return _verify(t, c, given, "TOPP-RA")


def _verify(ends: Array, c: Array, values: Any, planner: str) -> tuple[Array, Array]:
    """Return the pieces, after a comparison with a planner's `values` halfway between breakpoints.

    ValueError: they differ by more than rounding.
    """
    middle = (ends[:-1] + ends[1:]) / 2
    wanted = np.array([np.asarray(values(float(t))) for t in middle]).reshape(len(middle), -1)
    off = float(np.max(np.abs(PPoly(c.transpose(2, 1, 0)[::-1], ends)(middle) - wanted)))
    if not off <= _OFF * max(float(np.max(np.abs(wanted))), 1.0):
        raise ValueError(
            f"trajectory: the polynomials read from {planner} differ by {off:.3g} from the positions that it returns"
        )
    return ends, c
