"""Sums of kernels that are polynomials times e^(−λ|r|), from moments: their time grows with centres plus times.

With S_k(i) = Σ_{j ≤ i} w_j (u_i − u_j)^k e^(−λ(u_i − u_j)), the moments of all centres up to the i-th, the sum over the
centres before a time t is the same polynomial of the moments, moved from the last centre before t to t:
S_k moved by h is e^(−λh) Σ_l C(k, l) h^(k − l) S_l. The centres after t are those before it in reversed time.
"""

from dataclasses import dataclass
from math import comb

import numpy as np
from numpy.polynomial import Polynomial

from trackably.arrays import Array


@dataclass(frozen=True)
class Decay:
    """The function P(|r|) e^(−λ|r|) with `rate` λ [1/s] and the `polynomial` P in |r| [s]."""

    rate: float
    polynomial: Polynomial

    def derivatives(self, order: int) -> list[Array]:
        """Return the coefficients of P, (d/dr − λ) P, …: the polynomials of derivatives for r > 0."""
        found = [self.polynomial]
        for _ in range(order):
            found.append(found[-1].deriv() - self.rate * found[-1])
        degree = self.polynomial.degree()
        return [np.pad(factor.coef, (0, degree + 1 - len(factor.coef))) for factor in found]


def summed_by_moments(decays: tuple[Decay, ...], centres: Array, weights: Array, t: Array, order: int) -> Array:
    """Return Σ_i c_i κ⁽ⁿ⁾(t − t_i) for n = 0 … order and κ a sum of `decays`: shape (order + 1, *t.shape).

    Odd derivatives count as 0 at r = 0, where those of κ may jump. Rounding is that of the direct sum, up to a factor
    of the logarithm of the number of centres.
    """
    at, place = np.unique(centres, return_inverse=True)
    joined = np.asarray(np.bincount(place, weights), dtype=float)
    times = t.ravel()
    found = np.zeros((order + 1, times.size))
    same = np.searchsorted(at, times)
    is_same = at[np.minimum(same, len(at) - 1)] == times
    for decay in decays:
        factors = decay.derivatives(order)
        before = _before(decay, factors, at, joined, times)
        after = _before(decay, factors, -at[::-1], joined[::-1], -times)
        for n, factor in enumerate(factors):
            found[n] += before[n] + (-1) ** n * after[n]
            if n % 2 == 0:
                found[n, is_same] += joined[same[is_same]] * factor[0]
    return found.reshape(order + 1, *t.shape)


def _before(decay: Decay, factors: list[Array], at: Array, weights: Array, times: Array) -> Array:
    """Return the sums over the centres that lie strictly before each time, for each factor."""
    last = np.searchsorted(at, times) - 1
    some = last >= 0
    reached = last[some]
    moments = _moved(_moments(decay, at, weights)[:, reached], times[some] - at[reached], decay.rate)
    found = np.zeros((len(factors), times.size))
    found[:, some] = np.array(factors) @ moments
    return found


def _moments(decay: Decay, at: Array, weights: Array) -> Array:
    """Return S_k(i): shape (degree + 1, n). Each step doubles the number of centres that each entry counts."""
    moments = np.zeros((decay.polynomial.degree() + 1, len(at)))
    moments[0] = weights
    apart = 1
    while apart < len(at):
        moments[:, apart:] += _moved(moments[:, :-apart], at[apart:] - at[:-apart], decay.rate)
        apart *= 2
    return moments


def _moved(moments: Array, by: Array, rate: float) -> Array:
    """Return the moments about points that lie later, each `by` its own distance [s]."""
    decay = np.exp(-rate * by)
    moved = [decay * sum(comb(k, i) * by ** (k - i) * moments[i] for i in range(k + 1)) for k in range(len(moments))]
    return np.array(moved)
