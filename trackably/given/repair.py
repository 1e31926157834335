"""Repair a trajectory that violates its bounds: find the nearest spline that can be proved, by quadratic programs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any, Literal, get_args

import numpy as np
from scipy import sparse
from scipy.interpolate import BSpline

from trackably.arrays import Array
from trackably.certificates.certificate import Certificate
from trackably.certificates.claim import Written
from trackably.certificates.outcome import Counterexample, Unproved
from trackably.control.programs import Program
from trackably.given.accepted import RepairDistance
from trackably.given.certify import CertifiedReference, Given
from trackably.given.conversion import as_pieces
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.pieces import PolynomialPieces
from trackably.systems.polytopes import slacks
from trackably.systems.reference import Reference
from trackably.systems.trajectories import Functional

_FEWEST, _MOST, _PER_PIECE = 64, 400, 4  # intervals between knots: least and most number, and number in each piece
_INSTANTS = 24  # times in each interval between knots at which bounds are imposed


Side = tuple[Any, Array]
"""Linear conditions on the vector x of all coefficients: a sparse matrix M and a vector y, for M x = y or M x ≤ y."""


@dataclass(frozen=True, eq=False)
class Splines:
    """B-splines of a `degree` with `knots` [s].

    If splines repeat (`repeats`), the knots continue periodically beyond both ends; otherwise the first and the last
    knot are multiple.
    """

    knots: Array
    degree: int
    repeats: bool = False

    @property
    def count(self) -> int:
        """The number of coefficients of one spline."""
        return len(self.knots) - 1 + (0 if self.repeats else self.degree)

    @cached_property
    def padded(self) -> Array:
        """The knots as SciPy expects them: with further knots before the first and after the last."""
        k, inner = self.degree, self.knots
        if not self.repeats:
            return np.pad(inner, k, mode="edge")
        period = inner[-1] - inner[0]
        return np.concatenate([inner[-1 - k : -1] - period, inner, inner[1 : k + 1] + period])

    def basis(self, t: Array) -> sparse.csr_array:
        """Return the matrix (len(t), count) that maps the coefficients of a spline to its values at t [s]."""
        within = t if self.repeats else np.clip(t, self.knots[0], self.knots[-1])
        basis = BSpline.design_matrix(within, self.padded, self.degree, "periodic" if self.repeats else False)
        found = sparse.csr_array(basis)
        columns = np.arange(found.shape[1])
        return sparse.csr_array(found @ sparse.csr_array((np.ones(columns.size), (columns, columns % self.count))))


@dataclass(frozen=True, eq=False)
class Nearest:
    """The search for `splines`, one for each flat output, near the `given` curves and within the bounds of the plant.

    States at the first knot are fixed to `held`, shape (n,), or free if it is None.
    """

    given: Given
    splines: Splines
    held: Array | None

    @classmethod
    def of(cls, given: Given, held: Array | None) -> Nearest:
        """Return the search with equidistant knots: four intervals for each piece of the curves, but 64 to 400 in all.

        No interval is shorter than a sampling step, unless fewer than 8 intervals are left.
        """
        step, orders = given.plant.sampling_time, given.plant.flatness.orders
        first, last = given.span
        if given.beyond == "end":
            last += (max(orders) + 1e-6) * step
        pieces = max(len(curve.coefficients) for curve in given.curves.values())
        count = min(max(_FEWEST, _PER_PIECE * pieces), _MOST, max(int((last - first) / step), 8))
        knots = np.linspace(first, last, count + 1)
        return cls(given, Splines(knots, max(5, max(orders) + 1), given.beyond == "period"), held)

    @cached_property
    def instants(self) -> Array:
        """Times [s] at which programs impose bounds, about 24 between two knots.

        Times before the first knot are included if they are claimed and inputs at them depend on the motion.
        """
        first, last = self.given.span
        if self.given.beyond == "rest" and first > 0:
            plant = self.given.plant
            first = max(0.0, first - max(plant.flatness.orders) * plant.sampling_time)
        return np.linspace(first, last, _INSTANTS * (len(self.splines.knots) - 1) + 1)

    def signals(self, coefficients: Array) -> tuple[PolynomialPieces, ...]:
        """Return the splines with these coefficients, shape (signals, count), as polynomial pieces."""
        of, beyond = self.splines, self.given.beyond
        wrapped = np.take(coefficients, np.arange(len(of.padded) - of.degree - 1) % of.count, axis=1)
        return tuple(as_pieces(BSpline(of.padded, c, of.degree), beyond) for c in wrapped)

    def rows(self, weights: Sequence[Sequence[Fraction | float]], t: Array) -> sparse.csr_array:
        """Return the matrix that maps all coefficients to a weighted sum of flat outputs, at t [s] and later steps.

        `weights[c][j]` is the weight of flat output c, j steps later.
        """
        none, step = sparse.csr_array((len(t), self.splines.count)), self.given.plant.sampling_time
        blocks = [
            sum((float(w) * self.splines.basis(t + j * step) for j, w in enumerate(of) if w), start=none)
            for of in weights
        ]
        return sparse.csr_array(sparse.hstack(blocks))

    def solve(self, backoff: float) -> Array | None:
        """Return the coefficients nearest to the curves that keep the tightened bounds at `instants`.

        The bounds are tightened by `backoff`, relative to their widths. None if no coefficients keep them.
        """
        equal, aims, at_most, times = self._begun, self._aims, list[Side](), self.instants
        for q in self.given.plant.quantities:
            functional, width = _requirement(q.functional), q.bounds.width
            row = self.rows(functional.weights, times) / width
            low, high = ((end - float(functional.offset)) / width for end in (q.bounds.lower, q.bounds.upper))
            at_most += [(row, np.full(len(times), high - backoff)), (-row, np.full(len(times), -low - backoff))]
        found = nearest(_stack(aims), equal, at_most)
        return None if found is None else found.reshape(-1, self.splines.count)

    @property
    def _begun(self) -> list[Side]:
        """The equations by which the states at the start equal `held`; no equations if these states are free."""
        found = []
        for state, value in zip(self.given.plant.flatness.states, () if self.held is None else self.held, strict=False):
            functional = _requirement(state.functional)
            row = self.rows(functional.weights, self.splines.knots[:1])
            scale = float(np.max(np.abs(row.data)))
            found.append((row / scale, np.array([(value - float(functional.offset)) / scale])))
        return found

    @property
    def _aims(self) -> list[Side]:
        """Equations for least squares: states or flat outputs equal their curves, each divided by its curve's range."""
        found, t = [], self.instants
        for i, (name, curve) in enumerate(self.given.curves.items()):
            stencil, values = self.given.stencils[name], curve(t)
            shown = self.rows([stencil.weights if j == i else () for j in range(len(self.given.curves))], t)
            size = float(np.max(np.abs(values)))
            scale = (float(np.ptp(values)) if np.ptp(values) > 1e-6 * size else size or 1.0) * np.sqrt(t.size)
            found.append((shown / scale, (values - stencil.offset) / scale))
        return found


def nearest(aim: Side, equal: Sequence[Side], at_most: Sequence[Side]) -> Array | None:
    """Minimise |M x − y|² with (M, y) = `aim`, under the conditions `equal` and `at_most`; None without a solution."""
    (M, wanted), (A, limits) = aim, _stack([*equal, *at_most])
    program = Program(2 * M.T @ M, -2 * M.T @ wanted, A, sum(len(values) for _, values in equal))
    return program.solve(limits, (1e-8, 5e-5))


def _stack(sides: Sequence[Side]) -> Side:
    rows, values = zip(*sides, strict=True)
    return sparse.csr_array(sparse.vstack(rows)), np.concatenate(values)


def _requirement(functional: Functional | None) -> Functional:
    assert functional is not None, "plants are linear here"
    return functional


Start = Literal["given", "free"]
"""Whether a repaired trajectory has to begin with the given states, or may begin with others."""

_BACKOFFS = (1e-7, 1e-5, 1e-4, 3e-4, 1e-3, 2e-3, 4e-3, 1e-2)
"""Back-offs (tightenings of the bounds, relative to their widths), tried in turn.

They leave room for the solver's tolerance, and for the times between those at which bounds are imposed.
"""


def repair(
    trajectory: Any,
    plant: ConstrainedSystem,
    claim: Written | None = None,
    start: Start = "given",
) -> CertifiedReference | Counterexample | Unproved:
    """Return the trajectory itself if it is proved, and otherwise the nearest spline that is proved.

    Arguments and exceptions are those of `certify`. To leave room for disturbances, give a plant with smaller sets. The
    spline has up to 400 pieces. Its degree is 5, or one more than the number of later steps that inputs depend on, if
    that is larger. It is nearest in the root mean square of all curves, each relative to its own range. It begins with
    the states of the reference that `certify` examines, to the precision of the solver, because a system in these
    states cannot begin elsewhere; the notes of `certify` say how these states differ from the curves. It may begin with
    other states if `start` is "free", if curves are periodic, or if the given states violate a bound at the start.
    Quadratic programs with bounds at many times find the spline. The bounds are tightened by a small part of their
    width until the proof succeeds. `CertifiedReference.moved` is the distance by which each curve was moved.

    Returns Unproved if no such spline was found within the bounds; another one may exist. Returns a Counterexample if a
    bound was still violated after the last attempt.

    ValueError: `start` is neither "given" nor "free".
    """
    if start not in get_args(Start):
        raise ValueError(f"repair: start must be one of {', '.join(get_args(Start))}, got {start!r}")
    given = Given.of(trajectory, plant, claim)
    outcome = given.prove(given.reference)
    if isinstance(outcome, Certificate):
        nowhere = {name: RepairDistance(0.0, 0.0) for name in given.curves}
        return CertifiedReference(outcome, given.off(outcome), nowhere)
    near = Nearest.of(given, _start_states(given) if start == "given" else None)
    for backoff in _BACKOFFS:
        coefficients = near.solve(backoff)
        if coefficients is None:
            return outcome if isinstance(outcome, Unproved) else _not_found(outcome, backoff, near)
        outcome = given.prove(Reference(near.signals(coefficients), plant))
        if isinstance(outcome, Certificate):
            return CertifiedReference(outcome, {}, _distances(given, outcome))
    return outcome


def _start_states(given: Given) -> Array | None:
    """Return the states at the start, shape (n,), which a repair has to keep.

    None if the curves are periodic, or if the states at the start violate a bound, or nearly do so.
    """
    if given.beyond == "period":
        return None
    at_start = given.reference.state_at(np.asarray(given.span[0]))
    left = slacks(given.plant.state_set, at_start)
    return at_start if np.all(left > _BACKOFFS[0]) else None


def _not_found(broken: Counterexample, backoff: float, near: Nearest) -> Unproved:
    begun, others = "", ""
    if near.held is not None:
        begun, others = " that begins with the given states", '; start="free" also allows other states at the start'
    reason = f"no spline{begun} was found within the bounds, tightened by {backoff:.0e} of their widths{others}"
    return Unproved(broken.quantity, broken.bounds, (broken.time, broken.time), broken.violation, reason)


def _distances(given: Given, certificate: Certificate) -> dict[str, RepairDistance]:
    """Return the distances of the given states from those of a proved reference."""
    times, found = np.linspace(*given.span, 20_001), {}
    for (name, most), signal in zip(given.off(certificate).items(), certificate.reference.pieces, strict=True):
        apart = given.stencils[name].measured(signal, times) - given.curves[name](times)
        found[name] = RepairDistance.of(apart, most)
    return found
