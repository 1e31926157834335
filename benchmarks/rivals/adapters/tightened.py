"""Bounds of a kernel's function on a compact set, by second-order cones.

P.-C. Aubin-Frankowski and Z. Szabó, Hard shape-constrained kernel machines (NeurIPS 2020), and Handling hard affine
SDP shape constraints in RKHSs (JMLR 2022): L g ≤ b holds for all times within δ of t_m if

    L_m g + η_m ‖g − m‖ ≤ b,        η_m = sup { ‖L_t κ − L_m κ‖ : |t − t_m| ≤ δ },

as |L_t g − L_m g| ≤ ‖L_t κ − L_m κ‖ ‖g − m‖. For a stationary kernel η does not depend on t_m.
"""

import cvxpy as cp
import numpy as np

from benchmarks.rivals.adapters.convex import minimised
from benchmarks.rivals.adapters.rows import POINTS, Grid, evenly, prior_covariance, root, sample_rows
from benchmarks.rivals.curves import curve_of
from benchmarks.rivals.model import Found, Problem
from trackably.arrays import Array
from trackably.gp.joint import JointPosterior
from trackably.gp.rows import Rows, Terms, row_kernel
from trackably.gp.signal import KernelSum
from trackably.learning.constraint import rows_of
from trackably.systems.trajectories import Functional

_LAGS = 16  # in which the supremum is sought; it is at the longest one where covariances fall with the distance


def solve(problem: Problem, points: int = POINTS) -> Found:
    """Solve min ‖y − S g‖²/σ² + ‖g − m‖² under the cones around as many times, at the likeliest hyperparameters."""
    times = evenly(problem, points)
    grid = Grid.of(problem, times)
    posterior, seen = problem.likeliest.posterior, sample_rows(problem)
    after = (n := len(seen)) + np.arange(len(grid.rows))
    rows = Rows(
        np.append(seen.offsets, grid.rows.offsets),
        tuple(Terms.joined([a, b.renumber(after)]) for a, b in zip(seen.terms, grid.rows.terms, strict=True)),
    )
    F = root(prior_covariance(posterior, rows))
    r = F.shape[1]
    levels = (part.mean for part in posterior.prior.parts)
    before = rows.values([lambda t, level=level: np.full(np.shape(t), level) for level in levels])
    parts = zip(posterior.prior.parts, posterior.samples, strict=True)
    noise = np.concatenate([float(part.noise_std) * samples.relative_noise for part, samples in parts])
    target = (np.concatenate([s.values for s in posterior.samples]) - before[:n]) / noise
    half = (times[1] - times[0]) / 2
    eta = np.repeat([steepness(posterior, f, half) for f in grid.functionals], points)
    S, v, size = F[:n] / noise[:, None], cp.Variable(r), cp.Variable()
    tight = eta * size
    above = F[n:] @ v + tight <= grid.upper - before[n:]
    below = F[n:] @ v - tight >= grid.lower - before[n:]
    objective = minimised(cp.sum_squares(S @ v - target) + cp.sum_squares(v), (above, below, cp.norm(v) <= size))
    # Stationarity: v (1 + Σ η μ/(2|v|)) = Fᵀ [(y − S g)/σ² ; (μ_below − μ_above)/2].
    shrink = 1 + float(eta @ (above.dual_value + below.dual_value)) / (2 * float(np.linalg.norm(v.value)))
    multipliers = np.concatenate([(target - S @ v.value) / noise, (below.dual_value - above.dual_value) / 2]) / shrink
    curve = curve_of(_signals(posterior, rows, multipliers), problem)
    return Found(curve, objective, "‖y − Sg‖²/σ² + ‖g − m‖²", points, posterior.prior)


def steepness(posterior: JointPosterior, functional: Functional, half: float) -> float:
    """Return η = sup ‖L_t κ − L_0 κ‖ over |t| ≤ `half` [s], an under-estimate by what lies between 16 lags."""
    rows = rows_of([(functional, np.linspace(0, half, _LAGS + 1))], len(functional.weights))
    covariance = prior_covariance(posterior, rows)
    apart = np.diag(covariance) + covariance[0, 0] - 2 * covariance[0]
    return float(np.sqrt(np.max(apart, initial=0.0)))


def _signals(posterior: JointPosterior, rows: Rows, multipliers: Array) -> tuple[KernelSum, ...]:
    """Return m + Σ_a α_a κ(·, L_a) of each process."""
    found = []
    for part, terms in zip(posterior.prior.parts, rows.terms, strict=True):
        centres = row_kernel(part.kernel, terms, len(rows)).centres
        places, at = np.unique(centres.times, return_inverse=True)
        weights = np.bincount(at, centres.spread(multipliers), len(places)).astype(float)
        found.append(KernelSum(part.kernel, part.mean, places, weights))
    return tuple(found)
