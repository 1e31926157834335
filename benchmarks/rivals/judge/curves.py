"""Curves that are no sums of kernels, and their largest violation: exact of polynomials, at the steps of sequences.

Rivals that know no sampled systems are judged as they see the system: x = (p, ṗ), u = p̈ at all times.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from benchmarks.rivals.judge.polynomials import Combination, Pieces, largest
from benchmarks.rivals.model import Curve, Problem, Violation
from trackably.arrays import Array
from trackably.gp.stencil import POINT, Stencil
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.intervals import Interval
from trackably.systems.trajectories import Quantity

_TOLERANCE = Fraction(1, 10**9)  # of the bound's width


@dataclass(frozen=True, eq=False)
class PolynomialCurve(Curve):
    """`seen` are the positions or flat outputs, and samples show a stencil of them; `bounded` are names, bounds and
    values of quantities.
    """

    seen: tuple[Pieces, ...]
    bounded: tuple[tuple[str, Interval, Pieces | Combination], ...]
    stencils: tuple[Stencil, ...] = ()

    def sampled(self, signal: int, t: Array) -> Array:
        stencil = self.stencils[signal] if self.stencils else POINT
        return stencil.measured(self.seen[signal], t)

    def violation(self, window: tuple[float, float]) -> Violation:
        start, end = map(Fraction, window)
        each = [_violation(name, bounds, p.within(start, end)) for name, bounds, p in self.bounded]
        worst = max(each, key=lambda found: found.least)
        mosts = [found.most for found in each]
        known = max(most for most in mosts if most is not None) if None not in mosts else None
        return Violation(worst.least, known, worst.quantity, worst.time)

    def violation_seen(self, window: tuple[float, float]) -> Violation:
        return max((_seen(name, bounds, p, window) for name, bounds, p in self.bounded), key=lambda found: found.least)


def _seen(name: str, bounds: Interval, values: Pieces | Combination, window: tuple[float, float]) -> Violation:
    """Return by how much the exact value at the worst of some times breaks its bounds, as a part of their width."""
    time = _worst_time(bounds, values, window)
    value = values.at(Fraction(time))
    outside = max(value - Fraction(bounds.upper), Fraction(bounds.lower) - value, Fraction(0))
    part = outside / (Fraction(bounds.upper) - Fraction(bounds.lower))
    return Violation(_rounded(part, -math.inf) if part else 0.0, None, name, time)


def _rounded(number: Fraction, towards: float) -> float:
    """Return a float64 that is no nearer than the number, seen from where it is rounded to."""
    return math.nextafter(float(number), towards)


def _worst_time(bounds: Interval, values: Pieces | Combination, window: tuple[float, float]) -> float:
    """Return where the margin is smallest in float64: at breaks, or where a derivative is zero between them."""
    inside = [t for t in values.as_scipy.derivative().roots(discontinuity=False, extrapolate=False) if np.isfinite(t)]
    times = np.concatenate([window, values.as_scipy.x, inside])
    times = times[(times >= window[0]) & (times <= window[1])]
    return float(times[np.argmin(bounds.margin(values(times)))])


def _violation(name: str, bounds: Interval, values: Pieces) -> Violation:
    low, high = Fraction(bounds.lower), Fraction(bounds.upper)
    tolerance = _TOLERANCE * (high - low)
    above = largest(_plus(values, -high), tolerance)
    below = largest(_plus(_negative(values), low), tolerance)
    worst = max(above, below, key=lambda found: found.least)
    most = max(above.most, below.most)
    least = max(worst.least, Fraction(0)) / (high - low)
    return Violation(
        _rounded(least, -math.inf) if least else 0.0,
        _rounded(most / (high - low), math.inf) if most > 0 else 0.0,
        name,
        float(worst.time),
    )


def _plus(values: Pieces, by: Fraction) -> Pieces:
    return Pieces(values.breaks, tuple((part[0] + by, *part[1:]) for part in values.parts))


def _negative(values: Pieces) -> Pieces:
    return Pieces(values.breaks, tuple(tuple(-a for a in part) for part in values.parts))


def of_flat_outputs(
    signals: Sequence[Pieces], stencils: Sequence[Stencil], plant: ConstrainedSystem
) -> PolynomialCurve:
    """Return the curve of flat outputs that are piecewise polynomials, for a linear sampled system.

    ValueError: a quantity is no weighted sum of them.
    """
    bounded = tuple((q.name, q.bounds, _quantity(q, signals)) for q in plant.quantities)
    return PolynomialCurve(tuple(signals), bounded, tuple(stencils))


def _quantity(quantity: Quantity, signals: Sequence[Pieces]) -> Combination:
    functional = quantity.functional
    if functional is None:
        raise ValueError(f"{quantity.name} is no weighted sum of flat outputs")
    step = Fraction(functional.sampling_time)
    shifted = tuple(
        (w, signals[c].shifted(j * step)) for c, row in enumerate(functional.weights) for j, w in enumerate(row) if w
    )
    return Combination(shifted, functional.offset)


def is_driven_by_accelerations(problem: Problem) -> bool:
    """Whether the system is ṗ = v, v̇ = u with as many inputs as positions."""
    if problem.continuous is None:
        return False
    A, B = problem.continuous
    m = B.shape[1]
    zero, one = np.zeros((m, m)), np.eye(m)
    return np.array_equal(A, np.block([[zero, one], [zero, zero]])) and np.array_equal(B, np.vstack([zero, one]))


def moving(positions: Sequence[Pieces], problem: Problem) -> PolynomialCurve:
    """Return the curve of these positions, with everything that is bounded."""
    speeds = [p.derivative() for p in positions]
    accelerations = [v.derivative() for v in speeds]
    of = {"state": [*positions, *speeds], "input": accelerations}
    bounded = tuple(
        (
            limit.name,
            limit.bounds,
            Combination(tuple((w, p) for w, p in zip(limit.row, of[limit.side], strict=True) if w)),
        )
        for limit in problem.task.plant.given_constraints
    )
    return PolynomialCurve(tuple(positions), bounded)


def interpolated(function: Callable[[float], float], breaks: Array, degree: int) -> Pieces:
    """Return the polynomials of this degree that a function is between its breaks, up to rounding in float64."""
    nodes = (1 - np.cos(np.pi * np.arange(degree + 1) / degree)) / 2
    powers = np.vander(nodes, increasing=True)
    parts = []
    for start, end in zip(breaks[:-1].tolist(), breaks[1:].tolist(), strict=True):
        values = [function(start + (end - start) * node) for node in nodes.tolist()]
        scaled, length = np.linalg.solve(powers, values), Fraction(end) - Fraction(start)
        parts.append(tuple(Fraction(c) / length**k for k, c in enumerate(scaled.tolist())))
    return Pieces(tuple(map(Fraction, breaks.tolist())), tuple(parts))


@dataclass(frozen=True, eq=False)
class StepCurve(Curve):
    """`states` (K + 1, n) and `inputs` (K, m) of a plant at steps 0 … K; samples show the states `shown`."""

    plant: ConstrainedSystem
    states: Array
    inputs: Array
    shown: tuple[int, ...]

    def sampled(self, signal: int, t: Array) -> Array:
        """Between steps, a straight line: only to compare with samples."""
        steps = np.arange(len(self.states)) * self.plant.sampling_time
        return np.asarray(np.interp(t, steps, self.states[:, self.shown[signal]]))

    def violation(self, window: tuple[float, float]) -> Violation:
        """At the steps, whose stored values are all that there is."""
        found = Violation(0.0, 0.0, at_steps=True)
        for limit in self.plant.given_constraints:
            values = (self.states if limit.side == "state" else self.inputs) @ np.array(limit.row, dtype=float)
            outside = -limit.bounds.margin(values) / limit.bounds.width
            k = int(np.argmax(outside))
            if outside[k] > found.least:
                time = k * self.plant.sampling_time
                found = Violation(float(outside[k]), float(outside[k]), limit.name, time, at_steps=True)
        return found

    def violation_seen(self, window: tuple[float, float]) -> Violation:
        """There is nothing beside the steps."""
        return self.violation(window)
