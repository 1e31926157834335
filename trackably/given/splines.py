"""Splines near given curves, as the unknowns of a quadratic program: bounds of states and inputs are linear in them."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import cvxpy as cp
import numpy as np
from scipy import sparse
from scipy.interpolate import BSpline

from trackably.arrays import Array
from trackably.given.certify import Given
from trackably.given.conversion import as_pieces
from trackably.systems.flat.functional import Functional
from trackably.systems.flat.trajectory import Coordinate
from trackably.systems.signals.pieces import PolynomialPieces

_FEWEST, _MOST, _PER_PIECE = 64, 400, 4
_INSTANTS = 6  # for each interval between knots


@dataclass(frozen=True, eq=False)
class Splines:
    """One spline of a `degree` for each flat output, with the same `knots` [s]: those of its ends are not repeated.

    States at the first knot are `held`, shape (n,), or free if it is None.
    """

    given: Given
    knots: Array
    degree: int
    held: Array | None

    @classmethod
    def of(cls, given: Given, held: Array | None) -> "Splines":
        """Choose knots: four in each piece of the curves, 64 to 400, and not closer than the steps."""
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
        """Knots as SciPy wants them: repeated at the ends, or continued by a period."""
        k, inner = self.degree, self.knots
        if self.given.beyond != "period":
            return np.concatenate([np.full(k, inner[0]), inner, np.full(k, inner[-1])])
        period = inner[-1] - inner[0]
        return np.concatenate([inner[-1 - k : -1] - period, inner, inner[1 : k + 1] + period])

    @cached_property
    def instants(self) -> Array:
        """Times of the claim [s] at which bounds count first: some for each interval between knots."""
        first, last = self.given.span
        return np.linspace(first, last, _INSTANTS * (len(self.knots) - 1) + 1)

    def signals(self, coefficients: Array) -> tuple[PolynomialPieces, ...]:
        """Return the splines of coefficients, shape (signals, count)."""
        wrapped = [np.resize(c, self.count + self.degree) if self.given.beyond == "period" else c for c in coefficients]
        return tuple(as_pieces(BSpline(self.padded, c, self.degree), self.given.beyond) for c in wrapped)

    def basis(self, t: Array) -> sparse.csr_array:
        """Return the splines at t [s] as rows of the coefficients of one signal: shape (len(t), count)."""
        first, last = self.knots[0], self.knots[-1]
        if self.given.beyond == "period":
            t = first + np.mod(t - first, last - first)
        found = BSpline.design_matrix(np.clip(t, first, last), self.padded, self.degree)
        if self.given.beyond != "period":
            return sparse.csr_array(found)
        columns = np.arange(found.shape[1]) % self.count
        return sparse.csr_array(found @ sparse.csr_array((np.ones(columns.size), (np.arange(columns.size), columns))))

    def rows(self, functional: Functional, t: Array) -> sparse.csr_array:
        """Return a functional at t [s], without its offset, as rows of all coefficients."""
        blocks = []
        for weights in functional.weights:
            terms = [float(w) * self.basis(t + j * functional.sampling_time) for j, w in enumerate(weights) if w]
            blocks.append(sum(terms[1:], terms[0]) if terms else sparse.csr_array((len(t), self.count)))
        return sparse.csr_array(sparse.hstack(blocks))

    def nearest(self, times: Array, backoff: float) -> Array | None:
        """Return the coefficients that are nearest to the curves and keep the drawn in bounds at some times [s].

        None: there are none.
        """
        unknown, plant = cp.Variable(len(self.given.curves) * self.count), self.given.plant
        constraints = self._begun(unknown)
        for q in plant.quantities:
            functional = _required(q.functional)
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
        """Return that the states at the start are those that are held."""
        if self.held is None:
            return []
        states, found = [_required(trajectory) for trajectory in self.given.plant.flatness.states], []
        for functional, value in zip(states, self.held.tolist(), strict=True):
            row = self.rows(functional, self.knots[:1])
            scale = float(np.max(np.abs(row.data)))
            found.append(row / scale @ unknown == (value - float(functional.offset)) / scale)
        return found

    def _apart(self, unknown: cp.Variable) -> Sequence[cp.Expression]:
        """Return what the flat outputs show, minus the curves, each as a part of its range."""
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
        """Return local minima of margins that are less than `room` of a width, on a grid that is `finer` [s]."""
        fine = np.interp(np.arange((len(times) - 1) * finer + 1) / finer, np.arange(len(times)), times)
        found = []
        for q in self.given.plant.quantities:
            functional = _required(q.functional)
            values = self.rows(functional, fine) @ coefficients.ravel() + float(functional.offset)
            margin = np.pad(q.bounds.margin(values) / q.bounds.width, 1, constant_values=np.inf)
            lowest = (margin[1:-1] <= margin[:-2]) & (margin[1:-1] <= margin[2:]) & (margin[1:-1] < room)
            found.append(fine[lowest])
        return np.unique(np.concatenate(found))


def _required(functional: Coordinate | None) -> Functional:
    assert isinstance(functional, Functional), "plants are linear here"
    return functional
