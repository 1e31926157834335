"""The function for fixed θ as a dense quadratic program, straight from its definition: no dual, no exchange."""

from collections.abc import Sequence
from dataclasses import dataclass

import cvxpy as cp
import numpy as np

from tests.trackably.learning.joint.instances import Case
from trackably.systems.trajectories import Functional

_NEGLIGIBLE = 1e-14  # of the largest variance: of directions in which the functions do not differ
_ACCURATE = {"tol_gap_abs": 1e-12, "tol_gap_rel": 1e-12, "tol_feas": 1e-12}


@dataclass(frozen=True)
class Linear:
    """Σ_c Σ_p w_p g_c(t_p) + offset: for each process, pairs (t_p, w_p)."""

    terms: tuple[tuple[tuple[float, float], ...], ...]
    offset: float


@dataclass(frozen=True)
class Optimum:
    """The least value of misfit and norm, and the values of all quantities (q, steps) of the function."""

    value: float
    quantities: np.ndarray


def least(case: Case) -> Optimum:
    """minimise ‖y − S g‖²_{Σ⁻¹} + ‖g − m‖²_H over sums of kernels at samples and steps, in all bounds (CLARABEL)."""
    times, quantities = case.times, case.plant.quantities
    seen = [_sample(case, c, t) for c, samples in enumerate(case.samples) for t in samples.times]
    bounded = [_at(q.functional, t) for q in quantities for t in times]
    required = [_at(one.trajectory.functional, one.time) for one in case.required]
    means, factor = _factor(case, [*seen, *bounded, *required])
    z = cp.Variable(factor.shape[1])
    values = means + factor @ z
    n, end = len(seen), len(seen) + len(bounded)
    y = np.concatenate([samples.values for samples in case.samples])
    widths = np.repeat([q.bounds.width for q in quantities], len(times))
    lower = np.repeat([q.bounds.lower for q in quantities], len(times))
    relative = cp.multiply(1 / widths, values[n:end] - lower)
    constraints = [relative >= 0, relative <= 1]
    constraints += (
        [value == one.value for value, one in zip(values[end:], case.required, strict=True)] if required else []
    )
    cost = cp.sum_squares(cp.multiply(1 / _noise(case), y - values[:n])) + cp.sum_squares(z)
    program = cp.Problem(cp.Minimize(cost), constraints)
    program.solve(solver=cp.CLARABEL, **_ACCURATE)
    return Optimum(float(program.value), values.value[n:end].reshape(len(quantities), -1))


def covariance(case: Case, functionals: Sequence[Linear]) -> np.ndarray:
    """Of all pairs, before any sample is seen."""
    total = np.zeros((len(functionals),) * 2)
    for c, part in enumerate(case.prior.parts):
        pairs = [pair for f in functionals for pair in f.terms[c]]
        row = np.repeat(np.arange(len(functionals)), [len(f.terms[c]) for f in functionals])
        t, w = np.array(pairs).reshape(-1, 2).T
        weights = np.zeros((len(functionals), len(t)))
        weights[row, np.arange(len(t))] = w
        total += weights @ part.kernel(t[:, None] - t) @ weights.T
    return total


def _factor(case: Case, functionals: Sequence[Linear]) -> tuple[np.ndarray, np.ndarray]:
    """Return prior means and F with covariance F Fᵀ: so that ‖z‖² is the norm of the function with values m + F z."""
    gram = covariance(case, functionals)
    scale = np.sqrt(gram.diagonal())
    values, vectors = np.linalg.eigh(gram / np.outer(scale, scale))
    kept = values > _NEGLIGIBLE * values[-1]
    return _means(case, functionals), scale[:, None] * vectors[:, kept] * np.sqrt(values[kept])


def _means(case: Case, functionals: Sequence[Linear]) -> np.ndarray:
    """Before any sample is seen."""
    return np.array([
        f.offset + sum(part.mean * w for part, terms in zip(case.prior.parts, f.terms, strict=True) for _, w in terms)
        for f in functionals
    ])  # fmt: skip


def _noise(case: Case) -> np.ndarray:
    """Standard deviations, sample by sample."""
    parts = zip(case.prior.parts, case.samples, strict=True)
    return np.concatenate([part.noise_std * samples.relative_noise for part, samples in parts])


def _at(functional: Functional, t: float) -> Linear:
    step = functional.sampling_time
    terms = (tuple((t + j * step, float(w)) for j, w in enumerate(ws)) for ws in functional.weights)
    return Linear(tuple(terms), float(functional.offset))


def _sample(case: Case, process: int, t: float) -> Linear:
    stencil = case.samples[process].stencil
    own = tuple((t + j * stencil.step, w) for j, w in enumerate(stencil.weights))
    terms = tuple(own if c == process else () for c in range(len(case.samples)))
    return Linear(terms, stencil.offset)
