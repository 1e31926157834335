"""Repair a trajectory that violates its bounds: find the nearest spline that can be proved, by quadratic programs."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, get_args

import cvxpy as cp
import numpy as np
from scipy import sparse
from scipy.interpolate import BSpline

from trackably.arrays import Array
from trackably.certificates.certificate import Certificate
from trackably.certificates.claim import Written
from trackably.certificates.judge import judge
from trackably.certificates.outcome import Counterexample, Unproved
from trackably.certificates.prove import prove, prove_on_window
from trackably.given.certify import CertifiedReference, Given, Moved, distance
from trackably.given.conversion import Interpolation, as_pieces
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.pieces import PolynomialPieces
from trackably.systems.reference import Reference
from trackably.systems.trajectories import Coordinate, Functional

_FEWEST, _MOST, _PER_PIECE = 64, 400, 4
_INSTANTS = 6  # for each interval between knots


@dataclass(frozen=True, eq=False)
class Splines:
    """One spline of a `degree` for each flat output, with the same `knots` [s], without repetitions at the ends.

    States at the first knot are fixed to `held`, shape (n,), or free if it is None.
    """

    given: Given
    knots: Array
    degree: int
    held: Array | None

    @classmethod
    def of(cls, given: Given, held: Array | None) -> Splines:
        """Choose knots: four in each piece of the curves, 64 to 400, and no closer than the steps."""
        step, orders = given.plant.sampling_time, given.plant.flatness.orders
        first, last = given.span
        if given.beyond == "end":
            last += (max(orders) + 1e-6) * step
        pieces = max(len(curve.coefficients) for curve in given.curves.values())
        count = min(max(_FEWEST, _PER_PIECE * pieces), _MOST, max(int((last - first) / step), 8))
        return cls(given, np.linspace(first, last, count + 1), max(5, max(orders) + 1), held)

    @property
    def count(self) -> int:
        """The number of coefficients of one spline."""
        intervals = len(self.knots) - 1
        return intervals if self.given.beyond == "period" else intervals + self.degree

    @cached_property
    def padded(self) -> Array:
        """Knots in SciPy's form: repeated at the ends, or continued by a period."""
        k, inner = self.degree, self.knots
        if self.given.beyond != "period":
            return np.concatenate([np.full(k, inner[0]), inner, np.full(k, inner[-1])])
        period = inner[-1] - inner[0]
        return np.concatenate([inner[-1 - k : -1] - period, inner, inner[1 : k + 1] + period])

    @cached_property
    def instants(self) -> Array:
        """Times [s] at which bounds are imposed first: some in each interval between knots."""
        first, last = self.given.span
        return np.linspace(first, last, _INSTANTS * (len(self.knots) - 1) + 1)

    def signals(self, coefficients: Array) -> tuple[PolynomialPieces, ...]:
        """Return the splines with these coefficients, shape (signals, count)."""
        wrapped = [np.resize(c, self.count + self.degree) if self.given.beyond == "period" else c for c in coefficients]
        return tuple(as_pieces(BSpline(self.padded, c, self.degree), self.given.beyond) for c in wrapped)

    def basis(self, t: Array) -> sparse.csr_array:
        """Return the values of the basis splines at t [s], as rows for the coefficients of one
        signal: shape (len(t), count).
        """
        first, last = self.knots[0], self.knots[-1]
        if self.given.beyond == "period":
            t = first + np.mod(t - first, last - first)
        found = BSpline.design_matrix(np.clip(t, first, last), self.padded, self.degree)
        if self.given.beyond != "period":
            return sparse.csr_array(found)
        columns = np.arange(found.shape[1]) % self.count
        return sparse.csr_array(found @ sparse.csr_array((np.ones(columns.size), (np.arange(columns.size), columns))))

    def rows(self, functional: Functional, t: Array) -> sparse.csr_array:
        """Return a functional at t [s], without its offset, as rows for all coefficients."""
        blocks = []
        for weights in functional.weights:
            terms = [float(w) * self.basis(t + j * functional.sampling_time) for j, w in enumerate(weights) if w]
            blocks.append(sum(terms[1:], terms[0]) if terms else sparse.csr_array((len(t), self.count)))
        return sparse.csr_array(sparse.hstack(blocks))

    def nearest(self, times: Array, backoff: float) -> Array | None:
        """Return the coefficients nearest to the curves that keep the tightened bounds at some times [s].

        None if there are none.
        """
        unknown, plant = cp.Variable(len(self.given.curves) * self.count), self.given.plant
        constraints = self._begun(unknown)
        for q in plant.quantities:
            functional = _requirement(q.functional)
            row, width = self.rows(functional, times) / q.bounds.width, q.bounds.width
            low, high = ((end - float(functional.offset)) / width for end in (q.bounds.lower, q.bounds.upper))
            constraints += [row @ unknown >= low + backoff, row @ unknown <= high - backoff]
        program = cp.Problem(cp.Minimize(cp.sum_squares(cp.hstack(self._apart(unknown)))), constraints)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # an inaccurate solution may still be proved
            try:
                program.solve(solver=cp.CLARABEL)
            except cp.SolverError:
                return None
        if program.status not in (cp.OPTIMAL, cp.OPTIMAL_INACCURATE) or unknown.value is None:
            return None
        return np.asarray(unknown.value).reshape(-1, self.count)

    def _begun(self, unknown: cp.Variable) -> list[cp.Constraint]:
        """Return the constraint that the states at the start equal `held`; empty if they are free."""
        if self.held is None:
            return []
        states, found = [_requirement(trajectory) for trajectory in self.given.plant.flatness.states], []
        for functional, value in zip(states, self.held.tolist(), strict=True):
            row = self.rows(functional, self.knots[:1])
            scale = float(np.max(np.abs(row.data)))
            found.append(row / scale @ unknown == (value - float(functional.offset)) / scale)
        return found

    def _apart(self, unknown: cp.Variable) -> Sequence[cp.Expression]:
        """Return the states or flat outputs that the curves give, minus the curves, each relative to its range."""
        found, t, n = [], self.instants, len(self.given.curves)
        for i, (name, curve) in enumerate(self.given.curves.items()):
            stencil, values = self.given.stencils[name], curve(t)
            first, *others = (w * self.basis(t + j * stencil.step) for j, w in enumerate(stencil.weights))
            shown = sum(others, first)
            blocks = [shown if j == i else sparse.csr_array(shown.shape) for j in range(n)]
            size = float(np.max(np.abs(values)))
            scale = (float(np.ptp(values)) if np.ptp(values) > 1e-6 * size else size or 1.0) * np.sqrt(t.size)
            found.append((sparse.csr_array(sparse.hstack(blocks)) @ unknown + stencil.offset - values) / scale)
        return found

    def broken_between(self, coefficients: Array, times: Array, finer: int, room: float) -> Array:
        """Return the times of local minima of margins below `room` (relative to a width), on a
        grid `finer` times as dense.
        """
        fine = np.interp(np.arange((len(times) - 1) * finer + 1) / finer, np.arange(len(times)), times)
        found = []
        for q in self.given.plant.quantities:
            functional = _requirement(q.functional)
            values = self.rows(functional, fine) @ coefficients.ravel() + float(functional.offset)
            margin = np.pad(q.bounds.margin(values) / q.bounds.width, 1, constant_values=np.inf)
            lowest = (margin[1:-1] <= margin[:-2]) & (margin[1:-1] <= margin[2:]) & (margin[1:-1] < room)
            found.append(fine[lowest])
        return np.unique(np.concatenate(found))


def _requirement(functional: Coordinate | None) -> Functional:
    assert isinstance(functional, Functional), "plants are linear here"
    return functional


Start = Literal["given", "free"]
"""Whether a repaired trajectory has to begin with the given states, or may begin with others."""

_BACKOFFS = (1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2)
"""Back-offs relative to the widths of bounds, for the solver's tolerance and for times between instants."""

_FINER, _EXCHANGES = 8, 3


def repair(
    trajectory: Any,
    plant: ConstrainedSystem,
    claim: Written | None = None,
    interpolation: Interpolation | None = None,
    start: Start = "given",
) -> CertifiedReference | Counterexample | Unproved:
    """Return the trajectory itself if it is proved, and otherwise the nearest spline that is.

    Arguments and exceptions are those of `certify`. The spline has degree 5, or one more than the system looks ahead,
    and up to 400 pieces. It is nearest in the root mean square of all curves, each relative to its own range. It begins
    with the given states, to the precision of the solver, because a system in these states cannot begin elsewhere. With
    `start` "free" it may begin with others. It also may if curves are periodic, or if the given states violate a bound
    at the start. Quadratic programs with bounds at many times find the spline. The bounds are tightened by a small part
    of their width until the proof succeeds. `CertifiedReference.moved` is the distance by which each curve was moved.

    Returns Unproved if no such spline was found within the bounds; another one may exist. Returns a Counterexample if a
    bound was still violated after the last attempt.

    ValueError: `start` is neither "given" nor "free".
    """
    if start not in get_args(Start):
        raise ValueError(f"repair: start must be one of {', '.join(get_args(Start))}, got {start!r}")
    given = Given.of(trajectory, plant, claim, interpolation)
    outcome = judge(given.prove())
    if isinstance(outcome, Certificate):
        nowhere = {name: Moved(0.0, 0.0) for name in given.curves}
        return CertifiedReference(given.reference, outcome, given.off(outcome), nowhere)
    splines = Splines.of(given, _start_states(given) if start == "given" else None)
    times = splines.instants
    for backoff in _BACKOFFS:
        coefficients, times = _solve(splines, times, backoff)
        if coefficients is None:
            return outcome if isinstance(outcome, Unproved) else _not_found(outcome, backoff, splines)
        reference = Reference(splines.signals(coefficients), plant)
        found = judge(prove_on_window(reference, *given.window.span) if given.window else prove(reference))
        if isinstance(found, Certificate):
            return CertifiedReference(reference, found, {}, _distances(given, reference, found))
        outcome = found
    return outcome


def _solve(splines: Splines, times: Array, backoff: float) -> tuple[Array | None, Array]:
    """Return coefficients that keep the bounds at many times [s], and nearly between them, with these times.

    The times are the given ones and local minima of margins between them. None as coefficients if there are none.
    """
    found = None
    for _ in range(_EXCHANGES):
        found = splines.nearest(times, backoff)
        if found is None or not (overlooked := splines.broken_between(found, times, _FINER, backoff / 2)).size:
            break
        times = np.union1d(times, overlooked)
    return found, times


def _start_states(given: Given) -> Array | None:
    """Return the states at the start, shape (n,), which a repair has to keep.

    None if the curves are periodic, or if the states at the start violate a bound.
    """
    if given.beyond == "period":
        return None
    at_start = given.reference.state_at(np.asarray(given.span[0]))
    limits = (limit for limit in given.plant.given_constraints if limit.side == "state")
    margins = (
        limit.bounds.margin(np.array(limit.row, dtype=float) @ at_start) / limit.bounds.width for limit in limits
    )
    return at_start if all(margin > _BACKOFFS[0] for margin in margins) else None


def _not_found(broken: Counterexample, backoff: float, splines: Splines) -> Unproved:
    reason = f"no spline was found within the bounds, tightened by {backoff:.0e} of their width"
    if splines.held is not None:
        reason += ', that begins with the given states; one may exist that does not (start="free")'
    return Unproved(broken.quantity, broken.bounds, (broken.time, broken.time), broken.violation, reason)


def _distances(given: Given, reference: Reference, certificate: Certificate) -> dict[str, Moved]:
    """Return the distances of the given states from those of a reference."""
    times, found = np.linspace(*given.span, 20_001), {}
    for (name, curve), signal in zip(given.curves.items(), reference.pieces, strict=True):
        stencil = given.stencils[name]
        apart = stencil.measured(signal, times) - curve(times)
        most = distance(curve, signal, stencil, reference, certificate.claim)
        found[name] = Moved(most, float(np.sqrt(np.mean(apart**2))))
    return found
