"""The function for fixed θ as a dense quadratic program, straight from its definition: no dual, no exchange.

Each functional Σ_p w_p g_c(t_p) + offset is its offset and its terms (c, t_p, w_p).
"""

from collections.abc import Sequence

import cvxpy as cp
import numpy as np

from tests.trackably.learning.joint.instances import Case
from trackably.systems.trajectories import Functional

_NEGLIGIBLE = 1e-14  # of the largest variance: of directions in which the functions do not differ
_ACCURATE = {"tol_gap_abs": 1e-12, "tol_gap_rel": 1e-12, "tol_feas": 1e-12}

Linear = tuple[float, list[tuple[int, float, float]]]


def least(case: Case) -> tuple[float, np.ndarray]:
    """Return the least ‖y − S g‖²_{Σ⁻¹} + ‖g − m‖²_H in all bounds (CLARABEL), and g's quantities (q, steps).

    g is a sum of kernels at samples and steps. With F Fᵀ the covariance of functionals, ‖z‖² is the norm of the
    function with their values m + F z.
    """
    quantities, parts = case.plant.quantities, case.prior.parts
    seen = [
        (of.stencil.offset, [(c, t + j * of.stencil.step, w) for j, w in enumerate(of.stencil.weights)])
        for c, of in enumerate(case.samples)
        for t in of.times
    ]
    bounded = [_at(q.functional, t) for q in quantities for t in case.times]
    required = [_at(one.trajectory.functional, one.time) for one in case.required]
    means, covariance = _moments(case, [*seen, *bounded, *required])
    scale = np.sqrt(covariance.diagonal())
    variances, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    kept = variances > _NEGLIGIBLE * variances[-1]
    F = scale[:, None] * vectors[:, kept] * np.sqrt(variances[kept])
    z = cp.Variable(F.shape[1])
    values, n, end = means + F @ z, len(seen), len(seen) + len(bounded)
    lower = np.repeat([q.bounds.lower for q in quantities], len(case.times))
    width = np.repeat([q.bounds.width for q in quantities], len(case.times))
    relative = cp.multiply(1 / width, values[n:end] - lower)
    constraints = [relative >= 0, relative <= 1]
    if required:
        constraints.append(values[end:] == np.array([one.value for one in case.required]))
    y = np.concatenate([of.values for of in case.samples])
    noise = np.concatenate([p.noise_std * of.relative_noise for p, of in zip(parts, case.samples, strict=True)])
    cost = cp.sum_squares(cp.multiply(1 / noise, y - values[:n])) + cp.sum_squares(z)
    program = cp.Problem(cp.Minimize(cost), constraints)
    program.solve(solver=cp.CLARABEL, **_ACCURATE)
    return float(program.value), values.value[n:end].reshape(len(quantities), -1)


def _moments(case: Case, functionals: Sequence[Linear]) -> tuple[np.ndarray, np.ndarray]:
    """Return the means of functionals, and the covariances of all pairs, before any sample is seen."""
    means = np.array([offset for offset, _ in functionals])
    covariance = np.zeros((len(functionals),) * 2)
    for c, part in enumerate(case.prior.parts):
        terms = [(row, t, w) for row, (_, of) in enumerate(functionals) for process, t, w in of if process == c]
        rows, t, w = (np.array(of) for of in zip(*terms, strict=True))
        weights = np.zeros((len(functionals), len(terms)))
        weights[rows, np.arange(len(terms))] = w
        means += part.mean * np.sum(weights, axis=1)
        covariance += weights @ part.kernel(t[:, None] - t) @ weights.T
    return means, covariance


def _at(functional: Functional, t: float) -> Linear:
    step = functional.sampling_time
    terms = [(c, t + j * step, float(w)) for c, ws in enumerate(functional.weights) for j, w in enumerate(ws)]
    return float(functional.offset), terms
