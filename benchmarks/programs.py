"""Quadratic programs on fine grids, whose bounds hold at the grid's times alone: what references are compared with.

CLARABEL solves them through cvxpy, whose own time is left out.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy

from trackably.arrays import Array
from trackably.gp.kernels.base import Kernel
from trackably.gp.kernels.matern import Matern32, Matern52
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.systems.intervals import Interval

_BETWEEN = 10  # points of the program from one sample to the next
_NEGLIGIBLE = 1e-12  # of the largest eigenvalue
_MOST_ENTRIES = 2_500_000  # of the matrix from coefficients to points


def smoothed(samples: Samples, bounds: Mapping[int, Interval], step: float, weight: float, seen: Array) -> Array:
    """Return the values at all samples of min ‖y − x‖² + weight ∫ x‴², x linear between times `step` [s] apart.

    `bounds` are those of derivatives by their order; only the samples in `seen` are followed.
    """
    import cvxpy as cp

    steps = (samples.times - samples.times[0]) / step
    before = np.floor(steps).astype(int)
    part, rows = steps - before, np.tile(np.arange(len(steps)), 2)
    places = rows, np.concatenate([before, before + 1])
    shape = len(steps), int(before[-1]) + 2
    at_samples = scipy.sparse.csr_array((np.concatenate([1 - part, part]), places), shape=shape)
    level = float(np.mean(samples.values))  # the program is solved about it: solvers are scaled for that
    x, kept = cp.Variable(shape[1]), np.flatnonzero(seen)
    constraints = []
    for order, each in bounds.items():
        of, by = (cp.diff(x, order) / step**order, 0.0) if order else (x, level)
        constraints += [of >= each.lower - by, of <= each.upper - by]
    off = at_samples[kept] @ x - (samples.values[kept] - level)
    cost = cp.sum_squares(off) + weight * step * cp.sum_squares(cp.diff(x, 3) / step**3)
    cp.Problem(cp.Minimize(cost), constraints).solve(solver="CLARABEL")
    return np.asarray(at_samples @ x.value + level)


@dataclass(frozen=True)
class Minimiser:
    """The root mean square of what the program's minimiser is off, its value, and the seconds that CLARABEL takes."""

    misfit: float
    value: float
    seconds: float


def likeliest(samples: Samples, prior: Prior, values: Interval, slopes: Interval, backoff: float = 0.0) -> Minimiser:
    """Find the likeliest function for these hyperparameters whose bounds are tightened by a part of their widths.

    There are ten points between samples. For Matérn kernels it is the sparse state-space form: the process and its
    derivatives at all points are the unknowns, and each step costs what it differs from its prediction, in the unit of
    the process noise. For others it is the low-rank form: the process at all points by a pivoted Cholesky factor of its
    covariance, whose coefficients are standard normal.
    """
    import cvxpy as cp

    step = float(np.median(np.diff(samples.times))) / _BETWEEN
    at = np.rint((samples.times - samples.times[0]) / step).astype(int)
    process, price = _process(cp, prior, int(at[-1]) + 1, step)
    off = (process[at] + prior.mean - samples.values) / float(prior.noise_std)
    bounds = []
    for of, by, each in ((process, prior.mean, values), (cp.diff(process) / step, 0.0, slopes)):
        inside = backoff * each.width
        bounds += [of >= each.lower + inside - by, of <= each.upper - inside - by]
    program = cp.Problem(cp.Minimize(cp.sum_squares(off) + price), bounds)
    program.solve(solver="CLARABEL")
    assert process.value is not None, program.status
    misses = process.value[at] + prior.mean - samples.values
    return Minimiser(float(np.sqrt(np.mean(misses**2))), float(program.value), float(program.solver_stats.solve_time))


def _process(cp: Any, prior: Prior, count: int, step: float) -> tuple[Any, Any]:
    """Return the process at all points, less its mean, and what it costs by its norm."""
    kernel = prior.kernel
    if isinstance(kernel, Matern32 | Matern52):
        before, across = _covariance(kernel, 0.0), _covariance(kernel, step)
        transition = across @ np.linalg.inv(before)
        root = np.linalg.cholesky(before - transition @ across.T)  # of what a step does not foretell
        x = cp.Variable((count, len(before)))
        innovations = (x[1:] - x[:-1] @ transition.T) @ np.linalg.inv(root).T
        begun = np.linalg.inv(np.linalg.cholesky(before)) @ x[0]
        return x[:, 0], cp.sum_squares(innovations) + cp.sum_squares(begun)
    columns = _columns(kernel, step * np.arange(count))
    coefficients = cp.Variable(len(columns))
    return columns.T @ coefficients, cp.sum_squares(coefficients)


def _columns(kernel: Kernel, times: Array) -> Array:
    """Return the columns of a pivoted Cholesky factor of the covariance at these times, as rows (m, n).

    RuntimeError: the program would be too large.
    """
    left = np.full(len(times), kernel(np.zeros(())).item())
    negligible, found = _NEGLIGIBLE * left[0], np.empty((0, len(times)))
    while (largest := int(np.argmax(left))) >= 0 and left[largest] > negligible:
        if found.size > _MOST_ENTRIES:
            raise RuntimeError(
                f"a program of {len(times)} points with more than {len(found)} coefficients is too large"
            )
        column = kernel(times - times[largest]) - found[:, largest] @ found
        found = np.vstack([found, column / np.sqrt(left[largest])])
        left = left - found[-1] ** 2
    return found


def _covariance(kernel: Matern32 | Matern52, lag: float) -> Array:
    """Return the covariance of (g, g', …), as many as there are, with the same a `lag` [s] before."""
    order = 2 if isinstance(kernel, Matern32) else 3
    jet = kernel.jet(np.array(lag), 2 * order - 2)
    return np.array([[jet[i + j] * (-1.0) ** j for j in range(order)] for i in range(order)])
