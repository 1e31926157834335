"""Certify trajectories of joints: a proof that all limits hold between the points, or the first violation."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import groupby
from math import nextafter
from operator import itemgetter
from typing import Any

import numpy as np
from numpy.polynomial.polynomial import polyder
from scipy.interpolate import PPoly

from trackably.arguments import instance, positive
from trackably.arrays import Array, Flags
from trackably.certificates.outcome import Unproved
from trackably.checker.floats.intervals import bernstein
from trackably.checker.joints import BROKEN, FORMAT, ORDERS, VERSION, not_kept, read_joints
from trackably.checker.joints import JointTrajectory as Subject
from trackably.checker.polynomials import value_of_polynomial
from trackably.given.accepted import AcceptedProof, AcceptedRefutation, NotAcceptedError, RepairDistance
from trackably.joints.limits import Joints
from trackably.joints.trajectory import JointTrajectory
from trackably.systems.intervals import Interval, ends_shown, ends_within, rounded_text

TOLERANCE = 1e-9
"""From piece to piece, a derivative may jump by at most this, in its unit: such a jump counts as rounding."""


@dataclass(frozen=True, eq=False, repr=False)
class CertifiedTrajectory(AcceptedProof):
    """A `trajectory` that keeps all limits of `joints` between its points, as accepted by the checker.

    From piece to piece, the position of a joint and its derivatives below the highest limited one jump by at most
    `tolerance`, each in its unit. `moved` tells how far a repair moved each joint, and `factor` by how much the
    trajectory was slowed down; neither is part of the proof.

    NotAcceptedError (a ValueError): the checker does not accept this statement.
    """

    trajectory: JointTrajectory
    joints: Joints
    tolerance: float = TOLERANCE
    moved: Mapping[str, RepairDistance] = field(default_factory=dict)
    factor: float = 1.0

    @property
    def explanation(self) -> str:
        """One sentence for the user: the proved statement."""
        first, last = ends_within(*self.trajectory.span)
        times = f"t from {first} s to {last} s"
        if self.trajectory.rests:
            times = f"t ≥ {first} s, at rest from {ends_shown(*self.trajectory.span)[1]} s on"
        limited = ", ".join(ORDERS[r] for r, of in enumerate(self.joints.limits) if np.any(np.isfinite(of)))
        keep = "keep their" if len(self.joints.names) > 1 else "keeps its"
        said = [f"proved for all {times}: {', '.join(self.joints.names)} {keep} limits of {limited}"]
        said += [f"{name} was moved by {moved}" for name, moved in self.moved.items() if moved.most > 0]
        return "; ".join(said + ([f"slowed down {self.factor!r} times"] if self.factor != 1 else []))

    @property
    def content(self) -> dict[str, Any]:
        """The content of the file that the checker reads."""
        return _content(FORMAT, self.trajectory, self.joints, self.tolerance)


@dataclass(frozen=True)
class BrokenLimit:
    """A violation of the `limits` of a `joint`, which begins at about `begins` [s].

    `order` names the derivative, such as "velocity". `violation` is the largest excess that was found on one polynomial
    piece, rounded down, and occurs at `time` [s]. If the derivative `jumps`, the next higher derivative is infinite and
    exceeds any limits; then `limits` is None, and `violation` is the size of the jump. `place` has the indices by which
    the checker finds the violation.
    """

    joint: str
    order: str
    limits: tuple[float, float] | None
    begins: float
    time: float
    violation: float
    jumps: bool
    place: Mapping[str, Any] = field(repr=False, hash=False)

    def __str__(self) -> str:
        by = rounded_text(self.violation, "down")
        if self.jumps:
            return f"at t = {self.time:.9g} s the {self.order} of {self.joint} jumps by {by} at least"
        assert self.limits, "only a jump has none"
        return (
            f"from t = {self.begins:.9g} s on the {self.order} of {self.joint} is outside of "
            f"[{', '.join(ends_shown(*self.limits))}], by {by} at least at {self.time:.9g} s"
        )


@dataclass(frozen=True, eq=False, repr=False)
class BrokenLimits(AcceptedRefutation):
    """A proof that joints violate limits along a `trajectory`.

    `broken` has one entry for each joint that violates a limit: its first violation. `advice` says what helps, and is
    no part of the proof.

    NotAcceptedError (a ValueError): the checker does not accept this statement.
    """

    trajectory: JointTrajectory
    joints: Joints
    tolerance: float
    broken: tuple[BrokenLimit, ...]
    advice: tuple[str, ...] = ()

    @property
    def first(self) -> BrokenLimit:
        """The violation that begins earliest, over all joints."""
        return min(self.broken, key=lambda broken: broken.begins)

    @property
    def explanation(self) -> str:
        """A text for the user: the first violation of each joint, in the order of time, and the advice."""
        return "; ".join(map(str, (*sorted(self.broken, key=lambda broken: broken.begins), *self.advice)))

    @property
    def content(self) -> dict[str, Any]:
        """The content of the file that the checker reads."""
        broken = [{**each.place, "violation": each.violation} for each in self.broken]
        return {**_content(BROKEN, self.trajectory, self.joints, self.tolerance), "broken": broken}


def certify_joints(
    trajectory: Any, joints: Joints, tolerance: float = TOLERANCE
) -> CertifiedTrajectory | BrokenLimits | Unproved:
    """Prove that a trajectory keeps all limits at all times between its first and its last point, or refute it.

    Parameters
    ----------
    trajectory
        A JointTrajectory with the names of the joints, in any order, or what `JointTrajectory.of` takes, with a column
        for each joint in their order. If the trajectory rests after its end, the limits are proved there, too.
    joints
        The joints with their limits.
    tolerance
        The largest jump, from piece to piece, of a joint's position and of its derivatives below the highest limited
        one, each in its unit. A larger jump breaks the limits of the next derivative. For example, the acceleration is
        infinite where the velocity jumps.

    Returns
    -------
    CertifiedTrajectory
        Proved, without any rounding error: a trajectory may touch its limits. The proof is about the polynomials with
        the given float64 coefficients. It does not include the rounding errors of a program that evaluates them.
    BrokenLimits
        Refuted: for each joint that breaks a limit, which one is broken first, when, and by how much.
    Unproved
        Neither proved nor refuted, because a number is too large, or the check takes too long.

    Raises
    ------
    ValueError
        If the names of the trajectory's joints are not those of `joints`, or the tolerance is not positive.
    TypeError
        If `trajectory` or `joints` has another type.

    """
    given, tolerance = fit_joints(trajectory, joints), positive("certify_joints: tolerance", tolerance)
    try:
        return CertifiedTrajectory(given, joints, tolerance)
    except NotAcceptedError as refused:
        reason = str(refused)
    try:
        if found := tuple(_first_broken(given, joints, tolerance)):
            return BrokenLimits(given, joints, tolerance, found)
    except NotAcceptedError as refused:
        reason = str(refused)
    return make_unproved(given, joints, reason)


def stretch_joints(
    trajectory: Any, joints: Joints, tolerance: float = TOLERANCE
) -> CertifiedTrajectory | BrokenLimits | Unproved:
    """Return the trajectory, slowed down by the least factor with which it keeps all limits.

    A trajectory that keeps them already is returned as it is. With s times the duration, a derivative of order r is s⁻ʳ
    times as large. So the least s is the largest of (q^(r)/limit)^(1/r), over all joints, orders and times. It is
    rounded up until the proof succeeds, by a part of 1e-9 at most. `CertifiedTrajectory.factor` is s. Arguments are
    those of `certify_joints`.

    Returns BrokenLimits if slowing down does not help: a position is outside its limits, or a derivative jumps.

    ValueError: the limits of some derivative do not have 0 inside, so that slowing down need not help; otherwise as
    `certify_joints`.
    """
    given, outcome = fit_joints(trajectory, joints), certify_joints(trajectory, joints, tolerance)
    if isinstance(outcome, CertifiedTrajectory):
        return outcome
    s = _least_factor(given, joints)
    for part in (0.0, *(2.0**-52 * 4.0**k for k in range(12)), 1e-9):
        slowed = given.slowed(factor := s * (1 + part))
        with suppress(NotAcceptedError):
            return CertifiedTrajectory(slowed, joints, tolerance, factor=factor)
    outcome = certify_joints(slowed, joints, tolerance)
    return replace(outcome, advice=(_NO_STRETCH,)) if isinstance(outcome, BrokenLimits) else outcome


_NO_STRETCH = "no slower motion mends that, while `repair_joints` looks for the nearest one that keeps its limits"


def make_unproved(given: JointTrajectory, joints: Joints, reason: str, joint: int | None = None) -> Unproved:
    """Return Unproved with a `reason`; its quantity is the first limited derivative, of a `joint` if one is given."""
    limited = np.argwhere(np.isfinite(joints.limits[:, :, 0])).tolist()
    r, j = next((at for at in limited if at[1] == joint), limited[0])
    bounds = Interval(*joints.limits[r, j].tolist())
    return Unproved(f"{ORDERS[r]} of {joints.names[j]}", bounds, given.span, 0.0, reason)


def fit_joints(trajectory: Any, joints: Joints) -> JointTrajectory:
    """Convert to a trajectory of exactly these joints, in their order. Raises the errors of `certify_joints`."""
    instance("certify_joints: joints", joints, Joints, "Joints")
    given = trajectory if isinstance(trajectory, JointTrajectory) else JointTrajectory.of(trajectory, joints.names)
    if given.names == joints.names:
        return given
    if {*given.names} != {*joints.names}:
        odd = sorted({*given.names} ^ {*joints.names})
        raise ValueError(
            f"trajectory: must have the joints {', '.join(joints.names)}, got {', '.join(given.names)}: {odd[0]!r} is "
            "only in one of these lists"
        )
    order = [given.names.index(name) for name in joints.names]
    return JointTrajectory(joints.names, given.breakpoints, given.coefficients[order], given.rests)


def _content(form: str, trajectory: JointTrajectory, joints: Joints, tolerance: float) -> dict[str, Any]:
    limits = joints.limits[: joints.order + 1].swapaxes(0, 1).tolist()
    return {
        "format": form,
        "version": VERSION,
        "joints": [
            {"name": name, "limits": [end if np.isfinite(end[0]) else None for end in of]}
            for name, of in zip(joints.names, limits, strict=True)
        ],
        "trajectory": {
            "breakpoints": trajectory.breakpoints.tolist(),
            "coefficients": trajectory.coefficients.tolist(),
            "beyond": "rest" if trajectory.rests else "end",
        },
        "jumps": [float(tolerance)] * joints.order,
    }


# Violations are searched for in float64, and then computed exactly.


def within_limits(c: Array, widths: Array, joints: Joints) -> Flags:
    """Return for each piece whether the Bernstein coefficients of all derivatives are within the limits: shape (K,).

    On its piece, a polynomial lies between its least and its largest Bernstein coefficient. So all joints keep all
    limits there, up to rounding. `c` has the shape (J, K, n) of joints, pieces and powers of time, and `widths` (K,)
    [s].
    """
    kept = np.full(len(widths), True)
    for r in range(joints.order + 1):
        d, (low, high) = polyder(c, r, axis=2), joints.limits[r].T[:, :, None, None]
        n = d.shape[2]
        b = (d * widths[:, None] ** np.arange(float(n))) @ bernstein(n).T
        kept &= np.all((low <= b) & (b <= high), axis=(0, 2))
    return kept


def _times_at(curve: PPoly, value: float) -> Array:
    """Return the times [s] at which a curve of one column has a value or jumps over it, up to rounding."""
    found = curve.solve(value, extrapolate=False)
    return found[np.isfinite(found)]  # a piece that has the value throughout gives its start and NaN


def _first_broken(given: JointTrajectory, joints: Joints, tolerance: float) -> Iterator[BrokenLimit]:
    """Yield the first violation of each joint that violates a limit."""
    subject: Subject = read_joints(_content(FORMAT, given, joints, tolerance))
    for _, of_joint in groupby(sorted(not_kept(subject), key=itemgetter(1, 3, 0, 2)), itemgetter(1)):
        for _, there in groupby(of_joint, itemgetter(3)):
            if found := [*filter(None, ((_jump if jumps else _outside)(subject, *at) for jumps, *at in there))]:
                yield min(found, key=lambda each: each.begins)
                break


def _jump(subject: Subject, j: int, r: int, i: int) -> BrokenLimit | None:
    """Return the jump of joint j's r-th derivative at breakpoint i; None if it is within the tolerance."""
    by, t = abs(subject.jump(j, r, i)), subject.breakpoints[i]
    if by <= Fraction(subject.jumps[r]):
        return None
    place = {"joint": j, "order": r, "jump": i}
    return BrokenLimit(subject.joints[j].name, ORDERS[r], None, t, t, _below(by), True, place)


def _outside(subject: Subject, j: int, r: int, i: int) -> BrokenLimit | None:
    """Return the violation of the limits of joint j's r-th derivative on piece i; None if there is none.

    It is looked for at the ends of the piece, at extremes and where limits are reached. It begins at the first of these
    times after which the derivative is outside; if rounding hides this time, at the time of the largest excess.
    """
    limit, t = subject.joints[j].limits[r], subject.breakpoints[i]
    assert limit is not None, "only derivatives with limits are undecided"
    (exact, width), (low, high) = subject.polynomial(j, i, r), map(Fraction, limit)
    h = float(width)
    h = h if Fraction(h) <= width else nextafter(h, 0.0)
    curve = PPoly(np.array([[float(c)] for c in exact])[::-1], [0.0, h or 1.0])  # h = 0: rest after the last piece
    times = np.sort([0.0, *_times_at(curve.derivative(), 0.0), *(s for end in limit for s in _times_at(curve, end)), h])
    by, since = max((max(low - (x := value_of_polynomial(exact, Fraction(s))), x - high), s) for s in times.tolist())
    if by <= 0:
        return None
    between = curve((times[:-1] + times[1:]) / 2)
    outside = np.flatnonzero((between < limit[0]) | (between > limit[1]))
    begins = t + float(times[outside[0]] if len(outside) else since)
    place = {"joint": j, "order": r, "piece": i, "since": since}
    return BrokenLimit(subject.joints[j].name, ORDERS[r], limit, begins, t + since, _below(by), False, place)


def _below(by: Fraction) -> float:
    return max(nextafter(float(by), 0.0), 5e-324)


def _least_factor(given: JointTrajectory, joints: Joints) -> float:
    """Return the least s ≥ 1 for which all derivatives, divided by s^r for order r, keep their limits."""
    s, ends = 1.0, given.at_ends(joints.order + 1)
    for r in range(1, joints.order + 1):
        low, high = joints.limits[r].T
        if len(wrong := np.flatnonzero(~((low < 0) & (high > 0)))):
            name = joints.names[wrong[0]]
            raise ValueError(
                f"stretch_joints: the limits of the {ORDERS[r]} of {name} must have 0 inside, as slowing down "
                "brings it close to 0"
            )
        for j, c in enumerate(given.coefficients):
            curve = PPoly(c.T[::-1], given.breakpoints).derivative(r)
            starts_and_extremes = np.append(given.breakpoints[:-1], _times_at(curve.derivative(), 0.0))
            values = np.append(curve(starts_and_extremes), ends[r, :, j])
            s = max(s, float(np.max(np.maximum(values / high[j], values / low[j]))) ** (1 / r))
    return s
