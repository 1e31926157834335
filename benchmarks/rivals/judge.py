"""Curves that rivals hand out, and by how much they break a bound at any time, with certainty.

The library's checker judges sums of kernels and piecewise polynomials alike. Rivals that know no sampled systems are
judged as they see the system: x = (p, ṗ), u = p̈ at all times. Sequences are judged at their steps.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
import scipy

from benchmarks.rivals.model import Curve, Problem, Violation
from trackably.arrays import Array
from trackably.certificates.certificate import Certificate
from trackably.certificates.draft import Draft
from trackably.certificates.outcome import Counterexample
from trackably.certificates.prove import prove_on_window
from trackably.certificates.sketch import sketches
from trackably.checker.intervals import exactly
from trackably.gp.stencil import POINT, Stencil
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.pieces import PolynomialPieces, Signal
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference

_WIDER = (1e-9, 1e-6, 1e-3, 1e-1)  # of the violation, and of the width a thousandth of it
_SEARCHES = 4


@dataclass(frozen=True, eq=False)
class ReferenceCurve(Curve):
    """A reference; samples show a stencil of each of its signals."""

    reference: Reference
    stencils: tuple[Stencil, ...]

    def sampled(self, signal: int, t: Array) -> Array:
        return self.stencils[signal].measured(self.reference.signals[signal], t)

    def violation(self, window: tuple[float, float]) -> Violation:
        """The least is an enclosed value at one time; the most is proved with bounds that are wider by as much."""
        found = self.violation_seen(window)
        for _ in range(_SEARCHES):
            outcome = prove_on_window(widened(self.reference, found.least), *window)
            if isinstance(outcome, Certificate):
                return Violation(found.least, found.least, found.quantity, found.time)
            if not isinstance(outcome, Counterexample):
                break
            more = _at(self.reference, outcome.quantity, outcome.time, window)
            found = max(found, more, key=lambda violation: violation.least)
        for by in _WIDER:
            most = found.least * (1 + by) + by * 1e-3
            if isinstance(prove_on_window(widened(self.reference, most), *window), Certificate):
                return Violation(found.least, most, found.quantity, found.time)
        return found

    def violation_seen(self, window: tuple[float, float]) -> Violation:
        drawn = zip(self.reference.quantities, sketches(self.reference, *window), strict=True)
        each = [_at(self.reference, quantity.name, of.worst_times[0], window) for quantity, of in drawn]
        return max(each, key=lambda violation: violation.least)


def _at(reference: Reference, name: str, time: float, window: tuple[float, float]) -> Violation:
    """Return by how much the bound is certainly broken at `time` [s], as a part of its width; zero if it is not."""
    of_kernels = not reference.pieces
    draft = Draft.of(reference, abs(time), np.array([time])) if of_kernels else Draft.of_pieces(reference, *window)
    bounds, value = reference.quantity(name).bounds, draft.value(name, Fraction(time))
    width = exactly(bounds.upper) - exactly(bounds.lower)
    broken = max(float(((bounds.lower - value) / width).a), float(((value - bounds.upper) / width).a))
    return Violation(max(float(np.nextafter(broken, -np.inf)), 0.0), None, name, time)


def widened(reference: Reference, by: float) -> Reference:
    """Return the same with all bounds wider by this part of their width, on both sides."""
    if not by:
        return reference
    plant = reference.plant
    sets = (_wider(plant.state_set, by), _wider(plant.input_set, by))
    return Reference(reference.signals, ConstrainedSystem(plant.system, *sets))


def _wider(bounded: Polytope, by: float) -> Polytope:
    more = by * (bounded.upper - bounded.lower)
    return Polytope(bounded.rows, bounded.lower - more, bounded.upper + more, bounded.dimension)


def curve_of(signals: Sequence[Signal], problem: Problem) -> ReferenceCurve:
    """Return the curve of a problem's flat outputs."""
    stencils = tuple(samples.stencil for samples in problem.task.samples)
    return ReferenceCurve(Reference(tuple(signals), problem.task.plant), stencils)


def is_driven_by_accelerations(problem: Problem) -> bool:
    """Whether the system is ṗ = v, v̇ = u with as many inputs as positions."""
    if problem.continuous is None:
        return False
    A, B = problem.continuous
    m = B.shape[1]
    zero, one = np.zeros((m, m)), np.eye(m)
    return np.array_equal(A, np.block([[zero, one], [zero, zero]])) and np.array_equal(B, np.vstack([zero, one]))


def moving(positions: Sequence[PolynomialPieces], problem: Problem) -> ReferenceCurve:
    """Return the curve of these positions, with their speeds and accelerations within the bounds of the plant."""
    plant, speeds = problem.task.plant, [derivative(p) for p in positions]
    names = (*plant.system.states, *plant.system.inputs)
    return tracing([*positions, *speeds, *map(derivative, speeds)], names, of_states_and_inputs(plant))


def of_states_and_inputs(plant: ConstrainedSystem) -> Polytope:
    """Return both sets as one, of (x, u)."""
    bounded = plant.state_set, plant.input_set
    rows = scipy.linalg.block_diag(*(of.rows for of in bounded))
    ends = (np.concatenate([getattr(of, end) for of in bounded]) for end in ("lower", "upper"))
    return Polytope(rows, *ends, rows.shape[1])


def tracing(signals: Sequence[PolynomialPieces], names: Sequence[str], within: Polytope) -> ReferenceCurve:
    """Return the curve of signals that are bounded themselves: the states of a system that goes wherever it likes."""
    n = len(names)
    anywhere = LinearSystem(np.zeros((n, n)), np.eye(n), states=tuple(names), sampling_time=1.0)
    free = Polytope.box([-np.inf] * n, [np.inf] * n)
    reference = Reference(tuple(signals), ConstrainedSystem(anywhere, within, free))
    return ReferenceCurve(reference, (POINT,) * n)


def derivative(of: PolynomialPieces) -> PolynomialPieces:
    """Return the derivative of each piece."""
    return PolynomialPieces(of.breakpoints, of.coefficients[:, 1:] * np.arange(1.0, of.degree + 1), of.beyond)


def interpolated(function: Callable[[float], float], breaks: Array, degree: int) -> PolynomialPieces:
    """Return the polynomials of this degree that a function is between its breaks, up to rounding in float64."""
    nodes, lengths = (1 - np.cos(np.pi * np.arange(degree + 1) / degree)) / 2, np.diff(breaks)
    values = np.array([[function(t) for t in row] for row in (breaks[:-1, None] + lengths[:, None] * nodes).tolist()])
    scaled = np.linalg.solve(np.vander(nodes, increasing=True), values.T).T
    return PolynomialPieces(breaks, scaled / lengths[:, None] ** np.arange(degree + 1.0))


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
