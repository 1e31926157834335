"""The dual program of many bounds, by an interior point method: each step is a regression with noise on the bounds.

The λ ≥ 0 that maximise 2 λᵀ d − λᵀ K λ have slacks s = K λ − d ≥ 0 with λ_a s_a = 0 for each a. Newton's method for
λ_a s_a = μ, with μ → 0, solves (K + D) Δλ = r with D = diag(s/λ), and both systems of a step have the same matrix. (S.
Mehrotra: On the implementation of a primal-dual interior point method, SIAM Journal on Optimization 2, 1992.)
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np

from trackably.arrays import Array
from trackably.gp.row_system import RowSystem

_MOST_STEPS = 60
_SMALL = 1e-13  # μ, relative to its value at the start
_EXACT = 1e-10  # slacks, relative to the largest demand
_JITTER = 1e-13  # relative to the variance of a row
_BACK = 0.995  # part of the longest step that keeps everything positive


class _Point(NamedTuple):
    """λ, s and K λ of rows that are scaled to the variance 1; or changes of these."""

    multipliers: Array
    slacks: Array
    applied: Array

    def moved(self, by: Self, length: float) -> "_Point":
        return _Point(*(value + length * change for value, change in zip(self, by, strict=True)))

    def longest(self, by: Self) -> float:
        """Return the part of a change, at most all of it, that keeps multipliers and slacks positive."""
        values, changes = np.concatenate(self[:2]), np.concatenate(by[:2])
        falls = changes < 0
        return float(np.min(-values[falls] / changes[falls], initial=1.0))

    @property
    def complementarity(self) -> float:
        """μ, the mean of λ_a s_a."""
        return float(self.multipliers @ self.slacks) / len(self.slacks)


@dataclass(frozen=True)
class _Newton:
    """The equations of Newton's method at a point, where K λ − d − s is `missed`; `solve` is that of K + D."""

    at: _Point
    missed: Array
    solve: Callable[[Array], Array]

    def step(self, products: Array) -> _Point:
        """Return the changes after which, to first order, λ_a s_a are these `products`, and nothing is missed."""
        multipliers, slacks, _ = self.at
        wanted = products / multipliers - slacks
        right = wanted - self.missed
        by = self.solve(right)
        return _Point(by, wanted - slacks / multipliers * by, right - (slacks / multipliers + _JITTER) * by)


def interior_multipliers(system: RowSystem, demand: Array) -> Array | None:
    """Return the multipliers λ (r,) of rows that shall be at least d = `demand` above their posterior mean.

    Those of rows that are not active are zero. None if the method does not converge in float64.
    """
    scale = np.sqrt(system.variances)
    if not np.all(scale > 0):
        return None
    d = demand / scale
    size = float(np.max(d))
    if size <= 0:
        return np.zeros(len(d))
    equal = np.full(len(d), size)
    at = _Point(equal, equal, system.product(equal / scale) / scale)
    for _ in range(_MOST_STEPS):
        missed, mu = at.applied - d - at.slacks, at.complementarity
        if mu <= _SMALL * size**2 and np.max(np.abs(missed)) <= _EXACT * size:
            return np.where(at.multipliers > at.slacks, at.multipliers, 0.0) / scale
        if (solve := _scaled(system, scale, at.slacks / at.multipliers + _JITTER)) is None:
            return None
        newton = _Newton(at, missed, solve)
        straight = newton.step(np.zeros(len(d)))
        ahead = at.moved(straight, at.longest(straight)).complementarity
        centred = newton.step((ahead / mu) ** 3 * mu - straight.multipliers * straight.slacks)
        at = at.moved(centred, min(1.0, _BACK * at.longest(centred)))
    return None


def _scaled(system: RowSystem, scale: Array, noise: Array) -> Callable[[Array], Array] | None:
    """Return the function that solves (K + D) x = b for rows divided by `scale`; None as `RowSystem.solver`."""
    solve = system.solver(noise * scale**2)
    return None if solve is None else lambda b: solve(b * scale) * scale
