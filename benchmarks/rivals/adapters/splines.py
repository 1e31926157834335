"""A cubic smoothing spline with bounds at many times: the smoothing by generalised cross-validation."""

from functools import partial

import cvxpy as cp
import numpy as np
from scipy.interpolate import BSpline

from benchmarks.rivals.adapters.convex import minimised
from benchmarks.rivals.adapters.rows import POINTS, Grid, by_basis, evenly
from benchmarks.rivals.curves import curve_of, integrated
from benchmarks.rivals.model import Found, Problem
from trackably.arrays import Array
from trackably.systems.pieces import PolynomialPieces, pieces_of_spline

_DEGREE = 3
_PIECES = 120
_SMOOTHINGS = np.logspace(-4, 8, 61)  # times the third power of the spacing: below the first it interpolates


def solve(problem: Problem, points: int = POINTS) -> Found:
    """Solve min Σ (y − s)² + λ ∫ s″² with bounds at as many times."""
    plant, task = problem.task.plant, problem.task
    grid = Grid.of(problem, evenly(problem, points))
    step, longest = plant.sampling_time, max(plant.flatness.orders)
    start, end = problem.window[0], problem.window[1] + longest * step
    inner = np.linspace(start, end, _PIECES + 1)
    knots = np.concatenate([[start] * _DEGREE, inner, [end] * _DEGREE])
    curvatures = BSpline(knots, np.eye(len(knots) - _DEGREE - 1), _DEGREE).derivative(2)
    # Gauss's rule with two nodes is exact for squares of lines.
    bending, basis = integrated(curvatures, inner, 2), partial(_values, knots)
    costs, smoothings = [], []
    c = cp.Variable((plant.signal_count, len(knots) - _DEGREE - 1))
    for coefficients, samples in zip(c, task.samples, strict=True):
        y = samples.values - samples.stencil.offset
        S = samples.stencil.measured(basis, samples.times) - samples.stencil.offset
        spacing = float(np.ptp(samples.times)) / (len(samples) - 1)
        smoothing = _cross_validated(S, y, bending, _SMOOTHINGS * spacing**3)
        costs += [cp.sum_squares(S @ coefficients - y), smoothing * cp.quad_form(coefficients, cp.psd_wrap(bending))]
        smoothings.append(smoothing)
    values = by_basis(grid.rows, basis) @ cp.vec(c, order="C") + grid.rows.offsets
    objective = minimised(cp.sum(costs), (values <= grid.upper, values >= grid.lower))
    signals = [_pieces(knots, of) for of in c.value]
    says = f"λ = {', '.join(f'{smoothing:.2g}' for smoothing in smoothings)} by cross-validation"
    return Found(curve_of(signals, problem), objective, "Σ (y − s)² + λ ∫ s″²", points, says=says)


def _values(knots: Array, t: Array) -> Array:
    return np.asarray(BSpline.design_matrix(np.clip(t, knots[0], knots[-1]), knots, _DEGREE).toarray())


def _cross_validated(S: Array, y: Array, bending: Array, smoothings: Array) -> float:
    """Return the λ of the least RSS/(n − tr H)², where H y are the values of the spline of this λ at the samples.

    A tiny ridge makes SᵀS + λB definite. A spline through all samples leaves nothing to judge it by.
    """
    n, seen = len(y), S.T @ S
    ridge = 1e-12 * np.trace(seen) / len(seen) * np.eye(len(seen))

    def score(smoothing: float) -> float:
        H = S @ np.linalg.solve(seen + smoothing * bending + ridge, S.T)
        free = n - np.trace(H)
        return float(np.sum((y - H @ y) ** 2) / free**2) if free > 1e-6 * n else np.inf

    return min(smoothings.tolist(), key=score)


def _pieces(knots: Array, coefficients: Array) -> PolynomialPieces:
    ends, c = pieces_of_spline(BSpline(knots, coefficients, _DEGREE))
    return PolynomialPieces(ends, c.T)
