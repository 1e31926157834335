"""Trajectories of joints: limits of position and derivatives that hold at all times. This is a theorem of its own.

Form. {"format": "trackably joint trajectory", "version": 1, "joints": [{"name", "limits": [[lower, upper] or null, …]},
…], "trajectory": {"breakpoints": [t_0, …, t_K], "coefficients": [[[c_0, …, c_n], …], …], "beyond": "rest" or "end"},
"jumps": [d_0, …, d_(R−1)]}. Each joint has R + 1 limits, R ≤ 4: of its position and its first R derivatives; null is no
limit.

Theorem. Each joint is q(t) = Σ_k c_k (t − t_i)^k for t_i ≤ t ≤ t_(i+1), with its own coefficients; every stored float64
stands for exactly one real number. If `check` answers Proved, then on each piece, closed on both sides, the derivative
q^(r) stays in its limits, r = 0, …, R. At each breakpoint between two pieces q^(r) jumps by d_r at most, if the joint
has limits of an order above r. Where the trajectory rests beyond its end, q stays at its last value, and this counts as
one more piece. So for t_0 ≤ t ≤ t_K, or for all t ≥ t_0, the limits hold of every derivative, and each derivative below
a joint's highest limited one changes by nothing but the integral of the next one and by these jumps: apart from the
jumps, no limited derivative has an impulse at a breakpoint. Nothing is said about rounding errors of a program that
evaluates q.

If `check` answers Refuted of a "trackably broken joint trajectory", which has the additional field "broken", then each
entry of this field is true. The entry {"joint", "order": r, "piece": i, "since": s, "violation": v > 0} says that
q^(r) is outside its limits by at least v at t_i + s, on piece i. The entry {"joint", "order": r, "jump": i,
"violation": v} says that q^(r), of a joint with limits of an order above r, jumps by at least v > d_r at t_i.

Proof. On a piece of width h, q^(r) is Σ_k a_k x^k with a_k = c_(k+r) (k + r)!/k! h^k and 0 ≤ x ≤ 1, a polynomial with
rational coefficients. The differences between this polynomial and its limits are shown to be nowhere negative, as in
`piecewise`. Jumps are compared in rational numbers. No step is checked in float64 first.
"""

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from math import factorial, perm
from typing import Any

from trackably.checker.answers import FailedStepError
from trackably.checker.form import (
    UnreadableError,
    a_bound,
    a_pair,
    file_of,
    many,
    one_of,
    positive_number,
    real_number,
    record,
    short,
    whole_number,
)
from trackably.checker.intervals import in_whole_numbers
from trackably.checker.limits import CENTRES, COEFFICIENTS, COORDINATES
from trackably.checker.polynomials import stays_between, value_of_polynomial
from trackably.checker.watch import progress, tick

FORMAT, BROKEN, VERSION = "trackably joint trajectory", "trackably broken joint trajectory", 1
ORDERS = ("position", "velocity", "acceleration", "jerk", "snap")
"""Names of a joint's position and of its derivatives; the index is the order."""

Limit = tuple[float, float] | None


@dataclass(frozen=True)
class Joint:
    """A joint's name, and its limits by order of the derivative; None stands for no limit."""

    name: str
    limits: tuple[Limit, ...]

    @property
    def order(self) -> int:
        """The highest order with a limit; 0 without limits."""
        return max((r for r, limit in enumerate(self.limits) if limit), default=0)


@dataclass(frozen=True)
class JointTrajectory:
    """Polynomial pieces of all joints between common `breakpoints` [s]; `coefficients` are by joint, piece and power.

    jumps[r] is the largest jump that a derivative of order r may have at a breakpoint. If the trajectory `rests`, all
    joints stay where the last piece ends.
    """

    joints: tuple[Joint, ...]
    breakpoints: tuple[float, ...]
    coefficients: tuple[tuple[tuple[float, ...], ...], ...]
    rests: bool
    jumps: tuple[float, ...]

    def polynomial(self, joint: int, piece: int, order: int) -> tuple[list[Fraction], Fraction]:
        """Return a derivative on a piece, as coefficients in the time since the piece's start, and its length [s].

        An index `piece` after the last piece stands for the rest after the last breakpoint, with the length 0.
        """
        tick()
        if piece == len(self.breakpoints) - 1:
            return [Fraction(0) if order else value_of_polynomial(*self.polynomial(joint, piece - 1, 0))], Fraction(0)
        c, (start, end) = self.coefficients[joint][piece], map(Fraction, self.breakpoints[piece : piece + 2])
        return [Fraction(c[k]) * perm(k, order) for k in range(order, len(c))] or [Fraction(0)], end - start

    def jump(self, joint: int, order: int, at: int) -> Fraction:
        """Return the jump of a derivative at breakpoint `at` ≥ 1; at the last breakpoint, it is the jump to rest."""
        return self.polynomial(joint, at, order)[0][0] - value_of_polynomial(*self.polynomial(joint, at - 1, order))

    @property
    def pieces(self) -> int:
        """The number of pieces, including the rest."""
        return len(self.breakpoints) - (not self.rests)

    @property
    def inner(self) -> range:
        """The indices of the breakpoints at which jumps are checked."""
        return range(1, self.pieces)

    @property
    def fingerprint(self) -> str:
        """The SHA-256 of names, breakpoints and coefficients, with every number as its shortest exact decimal."""
        numbers = [[joint.name for joint in self.joints], _plain(self.breakpoints), _plain(self.coefficients)]
        return hashlib.sha256(repr([*numbers, self.rests]).encode()).hexdigest()


def _plain(value: Any) -> Any:
    return value + 0.0 if isinstance(value, float) else [*map(_plain, value)]


@dataclass(frozen=True)
class Broken:
    """A violation, by at least `violation`: a derivative of a joint outside its limits, or with too large a jump.

    Limits are broken at the time `since` [s] after the start of a `piece`. A jump is at the breakpoint with the index
    `jump`, which is −1 if limits are broken.
    """

    joint: int
    order: int
    violation: float
    piece: int = -1
    since: float = 0.0
    jump: int = -1


@dataclass(frozen=True)
class BrokenTrajectory:
    """A trajectory with its violations."""

    trajectory: JointTrajectory
    broken: tuple[Broken, ...]


def not_kept(of: JointTrajectory) -> Iterator[tuple[bool, int, int, int]]:
    """Yield (False, joint, order, piece) for limits that are not shown to be kept, and (True, …) for too large jumps.

    For a jump, the last index is that of the breakpoint. On a piece of width h, q^(r) h^r is the r-th derivative of a
    polynomial of x ∈ [0, 1]. It is compared with limits and jumps times h^r, in integers.
    """
    powers = max(len(of.jumps), *(len(piece) - 1 for pieces in of.coefficients for piece in pieces))
    whole: list[tuple[int, list[int], list[list[int]], list[list[int]]]] = []
    for joint, polynomials in zip(of.joints, of.coefficients, strict=True):
        _, (jumps, *rows) = in_whole_numbers([of.jumps, *(limit or () for limit in joint.limits), *polynomials])
        whole.append((order := joint.order, jumps, rows[: order + 1], rows[len(joint.limits) :]))
    last = len(of.breakpoints) - 1
    for i, (start, end) in enumerate(pairwise(map(Fraction, of.breakpoints))):
        progress(i, last)
        width, second = (end - start).as_integer_ratio()
        units = [width**r * second ** (powers - r) for r in range(powers + 1)]  # h^r, times the same positive number
        for j, (order, jumps, limits, pieces) in enumerate(whole):
            a = [c * unit for c, unit in zip(pieces[i], units, strict=False)]
            for r, (ends, unit) in enumerate(zip(limits, units, strict=False)):
                if ends and not stays_between(a, ends[0] * unit, ends[1] * unit):
                    yield False, j, r, i
                if r < order and i + 1 < last:
                    after = factorial(r) * sum(pieces[i + 1][r : r + 1]) * unit
                    if abs(after - sum(a)) > jumps[r] * unit:
                        yield True, j, r, i + 1
                a = [k * c for k, c in enumerate(a)][1:] or [0]
    for j, joint in enumerate(of.joints if of.rests else ()):
        for r, limit in enumerate(joint.limits):
            if limit and not limit[0] <= of.polynomial(j, last, r)[0][0] <= limit[1]:
                yield False, j, r, last
            if r < joint.order and abs(of.jump(j, r, last)) > of.jumps[r]:
                yield True, j, r, last


def check_joints(trajectory: JointTrajectory) -> None:
    """Raise FailedStepError at the first limit that is not shown to be kept, or the first jump that is too large."""
    found = ((jumps, r, j, i) for jumps, j, r, i in not_kept(trajectory))  # limits first, of low orders first
    if (first := min(found, default=None)) is None:
        return
    jumps, r, j, i = first
    what, start = f'the {ORDERS[r]} of "{trajectory.joints[j].name}"', trajectory.breakpoints[i]
    if jumps:
        raise FailedStepError(f"jump: {what} jumps by more than {trajectory.jumps[r]!r} at {start!r} s")
    limit = trajectory.joints[j].limits[r]
    assert limit is not None, "only derivatives with limits are compared"
    end = f"to {trajectory.breakpoints[i + 1]:.9g} s" if i + 1 < len(trajectory.breakpoints) else "on"
    raise FailedStepError(f"limit: {what} is not shown to keep [{limit[0]:g}, {limit[1]:g}] from {start:.9g} s {end}")


def check_broken(found: BrokenTrajectory) -> None:
    """Raise FailedStepError at the first of the claimed violations that is not shown."""
    of = found.trajectory
    for n, broken in enumerate(found.broken):
        by, j, r, i = Fraction(broken.violation), broken.joint, broken.order, broken.piece
        joint, shown = of.joints[j] if j < len(of.joints) else None, False
        limit = joint.limits[r] if joint and r < len(joint.limits) else None
        if joint and broken.jump in of.inner and r < joint.order:
            shown = abs(of.jump(j, r, broken.jump)) >= by > Fraction(of.jumps[r])
        elif broken.jump < 0 and limit and i < of.pieces:
            polynomial, width = of.polynomial(j, i, r)
            x, (low, high) = value_of_polynomial(polynomial, Fraction(broken.since)), map(Fraction, limit)
            shown = 0 <= broken.since <= width and max(low - x, x - high) >= by
        if not shown:
            raise FailedStepError(
                f"broken[{n}]: there is no such limit of joint {j} and order {r} at the stated time, or it is not "
                f"shown to be broken by {broken.violation!r}"
            )


# Statements about joint trajectories, in words.


def joints_statement(trajectory: JointTrajectory) -> str:
    """Return the proved statement in words."""
    kept = "; ".join(f'"{joint.name}": {_limits(joint)}' for joint in trajectory.joints)
    first, last = trajectory.breakpoints[0], trajectory.breakpoints[-1]
    times = f"t ≥ {first!r} s, at rest from {last!r} s on" if trajectory.rests else f"t from {first!r} s to {last!r} s"
    jumps = ", ".join(f"{name} {by!r}" for name, by in zip(ORDERS, trajectory.jumps, strict=False))
    return f"For every real {times}, all joints keep their limits, {kept}. {_identity(trajectory)}" + (
        f" Between two pieces they jump by no more than: {jumps}." if jumps else ""
    )


def joints_refutation(found: BrokenTrajectory) -> str:
    """Return the violations in words."""
    said = []
    for broken in found.broken:
        joint = found.trajectory.joints[broken.joint]
        what = f'the {ORDERS[broken.order]} of "{joint.name}"'
        if broken.jump >= 0:
            at = found.trajectory.breakpoints[broken.jump]
            said.append(f"at {at!r} s {what} jumps by at least {broken.violation!r}")
        else:
            at = found.trajectory.breakpoints[broken.piece]
            limit = joint.limits[broken.order]
            said.append(f"at {at!r} s + {broken.since!r} s {what} breaks {limit} by at least {broken.violation!r}")
    return f"REFUTED: {'; '.join(said)}. {_identity(found.trajectory)}"


def _identity(trajectory: JointTrajectory) -> str:
    pieces, joints = len(trajectory.breakpoints) - 1, len(trajectory.joints)
    return f"The trajectory has the SHA-256 {trajectory.fingerprint}, {pieces} pieces of {joints} joints."


def _limits(joint: Joint) -> str:
    return ", ".join(f"{ORDERS[r]} in {[*limit]}" for r, limit in enumerate(joint.limits) if limit) or "no limits"


# Readers of the files of joint trajectories.


def _limit(given: object, where: str) -> Limit:
    if given is None:
        return None
    low, high = a_pair(real_number, real_number)(given, where)
    if not low <= high:
        raise UnreadableError(f"{where} must be [lower, upper] with lower ≤ upper, or null, got [{low!r}, {high!r}]")
    return low, high


def _joint_trajectory(
    joints: tuple[Joint, ...], trajectory: dict[str, Any], jumps: tuple[float, ...]
) -> JointTrajectory:
    ends, rows = trajectory["breakpoints"], trajectory["coefficients"]
    if len(ends) < 2 or not all(a < b for a, b in pairwise(ends)):
        raise UnreadableError(
            f"trajectory.breakpoints must be two or more numbers, each larger than the one before, got {short(ends)}"
        )
    if len(rows) != len(joints) or any(len(row) != len(ends) - 1 for row in rows):
        raise UnreadableError("trajectory.coefficients must have a list for each joint, and in it one for each piece")
    if any(len(joint.limits) != len(jumps) + 1 for joint in joints) or len({joint.name for joint in joints}) < len(
        rows
    ):
        raise UnreadableError(
            f"joints must have different names, and each {len(jumps) + 1} entries (limits or null) in `limits`, one "
            f"more than `jumps` has, got {short([f'{joint.name}: {len(joint.limits)}' for joint in joints])}"
        )
    if not any(limit for joint in joints for limit in joint.limits):
        raise UnreadableError("joints must have at least one limit")
    return JointTrajectory(joints, ends, rows, trajectory["beyond"] == "rest", jumps)


_parts: dict[str, Any] = {
    "joints": many(record(Joint, name=a_bound, limits=many(_limit, len(ORDERS))), COORDINATES),
    "trajectory": record(
        dict,
        breakpoints=many(real_number, CENTRES),
        coefficients=many(many(many(real_number, COEFFICIENTS), CENTRES), COORDINATES),
        beyond=one_of(("rest", "end")),
    ),
    "jumps": many(positive_number, len(ORDERS) - 1, empty=True),
}
_index = whole_number(CENTRES, 0)
_at = {"joint": _index, "order": whole_number(len(ORDERS) - 1, 0), "violation": positive_number}


def _entry(given: object, where: str) -> Broken:
    if isinstance(given, dict) and "jump" in given:
        return record(Broken, **_at, jump=_index)(given, where)
    return record(Broken, **_at, piece=_index, since=real_number)(given, where)


read_joints = file_of("joint trajectory", VERSION, record(_joint_trajectory, **_parts))
read_broken_joints = file_of(
    "broken joint trajectory",
    VERSION,
    record(
        lambda broken, **about: BrokenTrajectory(_joint_trajectory(**about), broken),
        **_parts,
        broken=many(_entry, COORDINATES),
    ),
)
