"""The dual program of many bounds, by an interior point method: each step is a regression with noise on the bounds.

The λ ≥ 0 that maximise 2 λᵀ d − λᵀ K λ have slacks s = K λ − d ≥ 0 with λ_a s_a = 0 for each a. Newton's method for
λ_a s_a = μ, with μ → 0, solves (K + D) Δλ = r with D = diag(s/λ). Each step solves for two r, those of a predictor and
of a corrector, with the same matrix. (S. Mehrotra: On the implementation of a primal-dual interior point method, SIAM
Journal on Optimization 2, 1992.)
"""

from collections.abc import Callable
from functools import partial

import numpy as np

from trackably.arrays import Array
from trackably.gp.row_system import RowSystem
from trackably.work import done

_MOST_STEPS = 60
_SMALL = 1e-13  # the method ends when residuals are small and μ is at most this part of its first value
_EXACT = 1e-10  # residuals are small if each |K λ − d − s| is at most this part of the largest entry of d
_JITTER = 1e-13  # added to the diagonal of K, relative to the variance of a row
_BACK = 0.995  # part of the longest step that keeps λ and s positive


def interior_multipliers(system: RowSystem, scale: Array, d: Array) -> Array | None:
    """Return the λ ≥ 0 (r,) that maximise 2 λᵀ d − λᵀ K λ for the covariance K of rows divided by their `scale` (r,).

    They are the multipliers of r rows (linear functionals of a function) whose values, divided by their scale, have to
    exceed their posterior means by d (r,); λ_a = 0 if row a is inactive. `system` has the covariance of the undivided
    rows. None if the method does not converge in float64.
    """
    size = float(np.max(d))
    if size <= 0:
        return np.zeros(len(d))
    multipliers = slacks = np.full(len(d), size)
    applied = system.product(multipliers / scale) / scale
    for _ in range(_MOST_STEPS):
        done("part")
        missed, mu = applied - d - slacks, float(multipliers @ slacks) / len(d)
        if mu <= _SMALL * size**2 and np.max(np.abs(missed)) <= _EXACT * size:
            return np.where(multipliers > slacks, multipliers, 0.0)
        if (solve := system.solver(np.ones(len(d), dtype=bool), slacks / multipliers + _JITTER)) is None:
            return None
        step = partial(_newton_step, solve, scale, multipliers, slacks, missed)
        along, across, _ = step(np.zeros(len(d)))
        length = _longest(multipliers, slacks, along, across)
        ahead = float((multipliers + length * along) @ (slacks + length * across)) / len(d)
        centred = step((ahead / mu) ** 3 * mu - along * across)
        length = min(1.0, _BACK * _longest(multipliers, slacks, *centred[:2]))
        multipliers, slacks, applied = (
            at + length * change for at, change in zip((multipliers, slacks, applied), centred, strict=True)
        )
    return None


def _newton_step(
    solve: Callable[[Array], tuple[Array, Array]],
    scale: Array,
    multipliers: Array,
    slacks: Array,
    missed: Array,
    products: Array,
) -> tuple[Array, Array, Array]:
    """Return the changes of λ, s and K λ after which, to first order, λ_a s_a are `products` and K λ − d − s is zero.

    λ are the `multipliers` and s the `slacks`. Before the step, K λ − d − s is `missed`. K is the covariance of rows
    divided by their `scale` (r,). `solve` takes the undivided rows: its matrix is C (K + diag(s/λ)) C, C = diag(scale).
    """
    wanted = products / multipliers - slacks
    right = wanted - missed
    by = solve(right * scale)[0] * scale
    return by, wanted - slacks / multipliers * by, right - (slacks / multipliers + _JITTER) * by


def _longest(multipliers: Array, slacks: Array, along: Array, across: Array) -> float:
    """Return the largest step length, at most 1, at which no multiplier and no slack becomes negative.

    `along` are the changes of the multipliers for the length 1, `across` those of the slacks.
    """
    values, changes = np.concatenate([multipliers, slacks]), np.concatenate([along, across])
    falls = changes < 0
    return float(np.min(-values[falls] / changes[falls], initial=1.0))
