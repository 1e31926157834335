"""Certify trajectories of joints: a proof that all limits hold between the points, or the first violation."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import groupby
from math import nextafter
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import brentq

from trackably.arguments import instance, positive
from trackably.arrays import Array
from trackably.certificates.judge import judged_file
from trackably.certificates.outcome import Unproved
from trackably.checker import Proved, Refuted, Verdict
from trackably.checker.floats.intervals import bernstein
from trackably.checker.floats.pieces import undecided
from trackably.checker.joints import BROKEN, FORMAT, ORDERS, VERSION, read_joints, value
from trackably.checker.joints import JointTrajectory as Subject
from trackably.files import new_file, write_atomically
from trackably.joints.limits import Joints
from trackably.joints.trajectory import JointTrajectory, derivative
from trackably.systems.intervals import Interval, ends_shown, ends_within, rounded_text

TOLERANCE = 1e-9
"""Largest jump between pieces that counts as rounding, in the unit of the derivative."""


class NotAcceptedError(ValueError):
    """The checker does not accept a statement about a trajectory; the message has its reason."""


@dataclass(frozen=True)
class ObservedDistance:
    """How far a repair moved a joint, in its unit, as seen in float64 at many times: no part of what is proved.

    `most` is the largest distance, `rms` the root mean square.
    """

    most: float
    rms: float

    def __str__(self) -> str:
        return f"about {self.most:.3g}, {self.rms:.3g} in the root mean square, as seen in float64 at many times"


@dataclass(frozen=True, eq=False)
class CertifiedTrajectory:
    """A `trajectory` that keeps all limits of `joints` between its points, as accepted by the checker.

    Derivatives below a joint's highest limited one jump by at most `tolerance` from piece to piece, each in its unit.
    `moved` tells by how much a repair moved each joint, and `factor` by how much the trajectory was slowed down: no
    part of the proof.

    NotAcceptedError (a ValueError): the checker does not accept it.
    """

    trajectory: JointTrajectory
    joints: Joints
    tolerance: float = TOLERANCE
    moved: Mapping[str, ObservedDistance] = field(default_factory=dict)
    factor: float = 1.0

    def __post_init__(self) -> None:
        _accept(self, Proved, FORMAT)

    @property
    def explanation(self) -> str:
        """The proved statement in a sentence."""
        first, last = ends_within(*self.trajectory.span)
        times = f"t from {first} s to {last} s"
        if self.trajectory.rests:
            times = f"t ≥ {first} s, at rest from {ends_shown(*self.trajectory.span)[1]} s on"
        limited = ", ".join(ORDERS[r] for r, of in enumerate(self.joints.limits) if np.any(np.isfinite(of)))
        said = [f"proved for all {times}: {', '.join(self.joints.names)} keep their limits of {limited}"]
        said += [f"{name} was moved by {moved}" for name, moved in self.moved.items() if moved.most > 0]
        return "; ".join(said + ([f"slowed down {self.factor!r} times"] if self.factor != 1 else []))

    def save_certificate(self, path: Path | str) -> Path:
        """Write the proof for `python -m trackably check FILE`; return the path. Raises OSError."""
        write_atomically(file := new_file("save_certificate", path), vars(self)["accepted"])
        return file

    def __repr__(self) -> str:
        return f"CertifiedTrajectory({self.explanation})"


@dataclass(frozen=True)
class BrokenLimit:
    """A violation of a joint's `limits` that begins at about `begins` [s]; at `time` [s] it is `violation`.

    It is about one piece, and `violation` is the largest one found there. If the derivative `jumps`, the limits of the
    next higher derivative are violated beyond any number, and `violation` is the jump. The checker has accepted the
    violation.
    """

    joint: str
    order: str
    limits: tuple[float, float] | None
    begins: float
    time: float
    violation: float
    jumps: bool

    def __str__(self) -> str:
        by = rounded_text(self.violation, "down")
        if self.jumps:
            return f"at t = {self.time:.9g} s the {self.order} of {self.joint} jumps by {by} at least"
        return (
            f"from t = {self.begins:.9g} s on the {self.order} of {self.joint} is outside of {[*(self.limits or ())]}, "
            f"by {by} at least at {self.time:.9g} s"
        )


@dataclass(frozen=True, eq=False)
class BrokenLimits:
    """The first violation of each joint along a `trajectory`: an entry of `broken` for each joint
    that violates a limit.

    NotAcceptedError (a ValueError): the checker does not accept it.
    """

    trajectory: JointTrajectory
    joints: Joints
    tolerance: float
    broken: tuple[BrokenLimit, ...]
    places: tuple[Mapping[str, Any], ...]

    def __post_init__(self) -> None:
        _accept(self, Refuted, BROKEN, broken=[*map(dict, self.places)])

    @property
    def first(self) -> BrokenLimit:
        """The earliest violation of all."""
        return min(self.broken, key=lambda broken: broken.begins)

    @property
    def explanation(self) -> str:
        """The first violation of each joint, in the order of time."""
        return "; ".join(map(str, sorted(self.broken, key=lambda broken: broken.begins)))

    def save_counterexample(self, path: Path | str) -> Path:
        """Write the violations for `python -m trackably check FILE`; return the path. Raises OSError."""
        write_atomically(file := new_file("save_counterexample", path), vars(self)["accepted"])
        return file

    def __repr__(self) -> str:
        return f"BrokenLimits({self.explanation})"


def certify_joints(
    trajectory: Any, joints: Joints, tolerance: float = TOLERANCE
) -> CertifiedTrajectory | BrokenLimits | Unproved:
    """Prove that a trajectory keeps all limits at all times between its first and its last point, or refute it.

    Parameters
    ----------
    trajectory
        A JointTrajectory with the names of the joints, in any order, or what `JointTrajectory.of` takes, with a column
        for each joint in their order. Where it rests beyond its end, this is proved, too.
    joints
        The joints with their limits.
    tolerance
        By how much a joint's derivatives below its highest limited one may jump from piece to piece, each in its unit.
        A jump beyond it breaks the next limit: the acceleration is infinite where a velocity jumps.

    Returns
    -------
    CertifiedTrajectory
        Proved, without any error: limits that are touched are kept. It is about the polynomials of the float64
        coefficients; the rounding of who evaluates them is not in it.
    BrokenLimits
        Refuted: for each joint that breaks a limit, which one is broken first, when, and by how much.
    Unproved
        Neither: a number is too large, or the check takes too long.

    Raises
    ------
    ValueError
        Where names do not fit, or the tolerance is not positive.
    TypeError
        Where the trajectory is none.

    """
    given, tolerance = fit_joints(trajectory, joints), positive("certify_joints: tolerance", tolerance)
    try:
        return CertifiedTrajectory(given, joints, tolerance)
    except NotAcceptedError as refused:
        reason = str(refused)
    found = list(_first_broken(given, joints, tolerance))
    try:
        if found:
            return BrokenLimits(given, joints, tolerance, *zip(*found, strict=True))
    except NotAcceptedError as refused:
        reason = str(refused)
    return make_unproved(given, joints, reason)


def stretch_joints(
    trajectory: Any, joints: Joints, tolerance: float = TOLERANCE
) -> CertifiedTrajectory | BrokenLimits | Unproved:
    """Return the trajectory slowed down by the least factor with which it keeps all limits; itself if it keeps them.

    With s times the duration, a derivative of order r is s⁻ʳ times as large. So the least s is the largest of
    (q^(r)/limit)^(1/r), over all joints, orders and times. It is rounded up until the proof succeeds, by 1e-9 at most.
    `CertifiedTrajectory.factor` is s. Arguments are those of `certify_joints`.

    Returns BrokenLimits if slowing down does not help: a position is outside its limits, or a derivative jumps.

    ValueError: zero is not inside the limits of some derivative, so that a joint may not rest; else as
    `certify_joints`.
    """
    given, outcome = fit_joints(trajectory, joints), certify_joints(trajectory, joints, tolerance)
    if isinstance(outcome, CertifiedTrajectory):
        return outcome
    s = _least_factor(given, joints)
    for part in (0.0, *(2.0**-52 * 4.0**k for k in range(12))):
        factor = s * (1 + part)
        try:
            return CertifiedTrajectory(given.slowed(factor), joints, tolerance, factor=factor)
        except NotAcceptedError:
            continue
    return certify_joints(given.slowed(s * (1 + 1e-9)), joints, tolerance)


def make_unproved(given: JointTrajectory, joints: Joints, reason: str) -> Unproved:
    """Return the outcome that limits are not proved, with the reason; it names the first of them."""
    r, j = np.argwhere(np.isfinite(joints.limits[:, :, 0]))[0].tolist()
    bounds = Interval(*joints.limits[r, j].tolist())
    return Unproved(f"{ORDERS[r]} of {joints.names[j]}", bounds, given.span, 0.0, reason)


def fit_joints(trajectory: Any, joints: Joints) -> JointTrajectory:
    """Return a trajectory of exactly these joints, in their order. Raises as `certify_joints`."""
    instance("certify_joints: joints", joints, Joints, "Joints")
    if not isinstance(trajectory, JointTrajectory):
        named = None if isinstance(trajectory, Mapping) else joints.names
        trajectory = JointTrajectory.of(trajectory, named)
    given: JointTrajectory = trajectory
    if given.names == joints.names:
        return given
    if {*given.names} != {*joints.names}:
        odd = sorted({*given.names} ^ {*joints.names})
        raise ValueError(f"trajectory: must have the joints {', '.join(joints.names)}, but {odd[0]!r} is in one only")
    order = [given.names.index(name) for name in joints.names]
    return JointTrajectory(joints.names, given.breakpoints, given.coefficients[order], given.rests)


def _accept(found: CertifiedTrajectory | BrokenLimits, wanted: type[Verdict], form: str, **more: object) -> None:
    """Ask the checker, and store the bytes that it accepts. NotAcceptedError: it refuses them."""
    data, verdict = judged_file({"format": form, **_content(found.trajectory, found.joints, found.tolerance), **more})
    if not isinstance(verdict, wanted):
        raise NotAcceptedError(f"the checker does not accept it ({verdict})")
    object.__setattr__(found, "accepted", data)


def _content(trajectory: JointTrajectory, joints: Joints, tolerance: float) -> dict[str, Any]:
    limits = joints.limits[: joints.order + 1].swapaxes(0, 1).tolist()
    return {
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


# What is broken is sought in float64, and told exactly.


def _on_pieces(c: Array, widths: Array) -> Array:
    """Return Bernstein coefficients on pieces, along the last axis.

    A polynomial lies between its least and largest one.

    `c` has the shape (…, K, n), and `widths` (K,) [s].
    """
    n = c.shape[-1]
    return np.asarray((c * widths[:, None] ** np.arange(float(n))) @ bernstein(n).T)


def room(c: Array, widths: Array, joints: Joints) -> Array:
    """Return for each piece the least slack of its Bernstein coefficients, relative to each limit's width: (K,).

    If it is not negative, limits are kept, up to rounding.
    """
    found = np.full(len(widths), np.inf)
    for r in range(joints.order + 1):
        low, high = np.moveaxis(joints.limits[r], -1, 0)[:, :, None, None]
        b, some = _on_pieces(derivative(c, r), widths), np.isfinite(low)
        with np.errstate(invalid="ignore"):
            inside = np.where(some, np.minimum(b - low, high - b) / (high - low), np.inf)
        found = np.minimum(found, np.min(inside, axis=(0, 2)))
    return found


def extremes(polynomial: Array, width: float) -> Array:
    """Return the times since a breakpoint at which a polynomial may have its minimum or maximum, ends included."""
    d = derivative(polynomial, 1)
    used = np.flatnonzero(np.abs(d) * width ** np.arange(float(len(d))) > 1e-14 * np.max(np.abs(polynomial)))
    inner = np.roots(d[: used[-1] + 1][::-1]) if len(used) and used[-1] else np.zeros(0)
    real_ones = inner.real[(np.abs(inner.imag) < 1e-6 * width) & (inner.real > 0) & (inner.real < width)]
    return np.array([0.0, *np.sort(real_ones), width])


def _first_broken(
    given: JointTrajectory, joints: Joints, tolerance: float
) -> Iterator[tuple[BrokenLimit, dict[str, Any]]]:
    """Yield the first violation of each joint, and its place as the checker finds it."""
    subject: Subject = read_joints(_content(given, joints, tolerance))
    limits, jumps = undecided(subject)
    parts = [*((j, i, r, _outside) for j, r, i in limits), *((j, i, r, _jump) for j, r, i in jumps)]
    done, place = set[int](), itemgetter(0, 1)
    for (j, i), there in groupby(sorted(parts, key=place), place):
        if j not in done and (found := [each for _, _, r, broken in there for each in broken(subject, j, r, i)]):
            done.add(j)
            yield min(found, key=lambda each: each[0].begins)


def _jump(subject: Subject, j: int, r: int, i: int) -> Iterator[tuple[BrokenLimit, dict[str, Any]]]:
    """Yield a violation if a derivative jumps at a breakpoint."""
    by, t = abs(subject.jump(j, r, i)), subject.breakpoints[i]
    if by > Fraction(subject.jumps[r]):
        broken = BrokenLimit(subject.joints[j].name, ORDERS[r], None, t, t, _below(by), True)
        yield broken, {"joint": j, "order": r, "jump": i, "violation": broken.violation}


def _outside(subject: Subject, j: int, r: int, i: int) -> Iterator[tuple[BrokenLimit, dict[str, Any]]]:
    """Yield a violation if a derivative leaves its limits on a piece."""
    limit, width = subject.joints[j].limits[r], subject.width(i)
    assert limit is not None, "it is one of those that are not decided"
    exact = subject.polynomial(j, i, r)
    low, high = map(Fraction, limit)
    polynomial, h = np.array([float(c) for c in exact]), float(width)
    h = h if Fraction(h) <= width else nextafter(h, 0.0)
    by, since = max(
        (max(low - (x := value(exact, Fraction(t))), x - high), t) for t in extremes(polynomial, h).tolist()
    )
    if by <= 0:
        return
    begins, violation, name, t = h, _below(by), subject.joints[j].name, subject.breakpoints[i]
    for end, sign in zip(limit, (1.0, -1.0), strict=True):
        begins = min(begins, _leaves(sign * (polynomial - end * (np.arange(len(polynomial)) == 0)), h))
    broken = BrokenLimit(name, ORDERS[r], limit, t + begins, t + since, violation, False)
    yield broken, {"joint": j, "order": r, "piece": i, "since": since, "violation": violation}


def _leaves(margin: Array, h: float) -> float:
    """Return the first time at which a polynomial becomes negative; h if it does not."""
    times = extremes(margin, h)
    values = np.polynomial.polynomial.polyval(times, margin)
    if not np.any(values < 0):
        return h
    k = int(np.argmax(values < 0))
    if k == 0:
        return 0.0
    return float(brentq(np.polynomial.Polynomial(margin), times[k - 1], times[k]))


def _below(by: Fraction) -> float:
    return max(nextafter(float(by), 0.0), 5e-324)


def _least_factor(given: JointTrajectory, joints: Joints) -> float:
    """Return the least s ≥ 1 for which derivatives of order r, divided by s^r, are inside their limits."""
    widths, s = np.diff(given.breakpoints), 1.0
    for r in range(1, joints.order + 1):
        d = derivative(given.coefficients, r)
        for j, (low, high) in enumerate(joints.limits[r].tolist()):
            if not low < 0 < high:
                raise ValueError(
                    f"stretch_joints: the limits of the {ORDERS[r]} of {joints.names[j]} must have 0 inside"
                )
            b = _on_pieces(d[j], widths)
            most = np.max(np.maximum(b / high, b / low), axis=1)
            for i in np.argsort(-most).tolist():
                if most[i] <= s**r:
                    break
                times = extremes(d[j, i], float(widths[i]))
                values = np.polynomial.polynomial.polyval(times, d[j, i])
                s = max(s, float(np.max(np.maximum(values / high, values / low))) ** (1 / r))
    return s
