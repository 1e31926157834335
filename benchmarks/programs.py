"""Rivals of references: quadratic programs on fine grids, whose bounds hold only at the times of the grid.

CLARABEL solves them through cvxpy, whose own time is left out.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cvxpy as cp
import numpy as np
import scipy

from trackably.arrays import Array, root_mean_square
from trackably.gp.kernels.base import Kernel
from trackably.gp.kernels.matern import Matern32, Matern52
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.systems.intervals import Interval

_BETWEEN = 10  # points of the program from one sample to the next
_NEGLIGIBLE = 1e-12  # the factorisation ends at variances below this part of the first one
_MOST_ENTRIES = 2_500_000  # most entries of the matrix from coefficients to points


Bounds = Sequence[Interval]
"""Bounds of a function and of its derivatives, by the order of the derivative."""


def _within(x: Any, step: float, level: float, bounds: Bounds) -> list[Any]:
    """Return constraints that keep x + level, at times `step` [s] apart, and its differences within bounds."""
    found = []
    for order, each in enumerate(bounds):
        of = cp.diff(x, order) / step**order if order else x + level
        found += [of >= each.lower, of <= each.upper]
    return found


def smoothed(samples: Samples, bounds: Bounds, step: float, weight: float, seen: Array) -> Array:
    """Return the values at all samples of min ‖y − x‖² + weight ∫ x‴², x linear between times `step` [s] apart.

    Only the samples in `seen` are followed.
    """
    steps = (samples.times - samples.times[0]) / step
    hats = scipy.interpolate.BSpline.design_matrix(steps, np.arange(-1.0, np.floor(steps[-1]) + 3), 1)
    level = float(np.mean(samples.values))  # subtracted in the program, because solvers expect numbers near zero
    x, kept = cp.Variable(hats.shape[1]), np.flatnonzero(seen)
    off = hats[kept] @ x - (samples.values[kept] - level)
    cost = cp.sum_squares(off) + weight * step * cp.sum_squares(cp.diff(x, 3) / step**3)
    cp.Problem(cp.Minimize(cost), _within(x, step, level, bounds)).solve(solver="CLARABEL")
    return np.asarray(hats @ x.value + level)


@dataclass(frozen=True)
class Minimiser:
    """The minimiser of a program: root mean square distance from the samples, optimal value, time [s] of CLARABEL."""

    misfit: float
    value: float
    seconds: float


def likeliest(samples: Samples, prior: Prior, bounds: Bounds) -> Minimiser:
    """Find the likeliest function for these hyperparameters within bounds.

    There are ten points between samples. For Matérn kernels, the program has the sparse state-space form: unknowns are
    the process and its derivatives at all points, and the cost is the squared difference of each step from its
    prediction, in the unit of the process noise. For other kernels, it has the low-rank form: the process at all points
    is a pivoted Cholesky factor of its covariance times coefficients, which are standard normal.
    """
    step = float(np.median(np.diff(samples.times))) / _BETWEEN
    at = np.rint((samples.times - samples.times[0]) / step).astype(int)
    process, price = _process(prior, int(at[-1]) + 1, step)
    off = process[at] + prior.mean - samples.values
    cost = cp.sum_squares(off / float(prior.noise_std)) + price
    program = cp.Problem(cp.Minimize(cost), _within(process, step, prior.mean, bounds))
    program.solve(solver="CLARABEL")
    assert process.value is not None, program.status
    return Minimiser(root_mean_square(off.value), float(program.value), float(program.solver_stats.solve_time))


def _process(prior: Prior, count: int, step: float) -> tuple[Any, Any]:
    """Return expressions for the process minus its mean at all points, and for its cost."""
    kernel = prior.kernel
    if isinstance(kernel, Matern32 | Matern52):
        before, across = _covariance(kernel, 0.0), _covariance(kernel, step)
        transition = across @ np.linalg.inv(before)
        root = np.linalg.cholesky(before - transition @ across.T)  # factor of the prediction error's covariance
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
    """Return the covariance of the state (g, g', …) of a Matérn process with the state a `lag` [s] earlier."""
    order = 2 if isinstance(kernel, Matern32) else 3
    jet = kernel.jet(np.array(lag), 2 * order - 2)
    return np.array([[jet[i + j] * (-1.0) ** j for j in range(order)] for i in range(order)])
