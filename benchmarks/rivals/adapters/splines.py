"""A cubic smoothing spline with bounds at many times: the smoothing by generalised cross-validation."""

from functools import partial

import cvxpy as cp
import numpy as np
import scipy
from scipy.interpolate import BSpline

from benchmarks.rivals.adapters.convex import minimised
from benchmarks.rivals.adapters.rows import POINTS, Grid, by_basis, evenly
from benchmarks.rivals.curves import curve_of
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
    bending, basis = _bending(knots, inner), partial(_values, knots)
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


def _bending(knots: Array, inner: Array) -> Array:
    """Return the matrix of ∫ s″², exactly: s″ is linear between knots."""
    size = len(knots) - _DEGREE - 1
    half, middle = np.diff(inner) / 2, (inner[1:] + inner[:-1]) / 2
    # Gauss's rule with two nodes is exact for squares of lines.
    second = BSpline(knots, np.eye(size), _DEGREE)(
        np.concatenate([middle - half / 3**0.5, middle + half / 3**0.5]), nu=2
    )
    return np.asarray(second.T @ (np.tile(half, 2)[:, None] * second))


def _cross_validated(S: Array, y: Array, bending: Array, smoothings: Array) -> float:
    """Return the λ of the least n RSS/(n − tr)².

    One factorisation serves all λ: with A = SᵀS + μB and SᵀS v = d A v, SᵀS + λB has the eigenvalues
    (1 − λ/μ) d + λ/μ. A tiny ridge makes A definite.
    """
    n, best, middle = len(y), (np.inf, float(smoothings[0])), float(np.sqrt(smoothings[0] * smoothings[-1]))
    seen = S.T @ S
    ridge = 1e-12 * np.trace(seen) / len(seen) * np.eye(len(seen))
    d, V = scipy.linalg.eigh(seen, seen + middle * bending + ridge)
    shown = S @ V
    along, d = shown.T @ y, np.clip(d, 0.0, 1.0)
    for smoothing in smoothings.tolist():
        part = smoothing / middle
        kept = 1 / ((1 - part) * d + part)
        free = n - float(kept @ d)
        if free > 1e-6 * n:
            score = n * float(np.sum((y - shown @ (kept * along)) ** 2)) / free**2
            best = min(best, (score, smoothing))
    return best[1]


def _pieces(knots: Array, coefficients: Array) -> PolynomialPieces:
    ends, c = pieces_of_spline(BSpline(knots, coefficients, _DEGREE))
    return PolynomialPieces(ends, c.T)
