"""Sums of squared exponentials over many centres, by few numbers for each box, since their exponents separate.

With d = r/θ₂ and η = h/θ₂ is κ(r + h x) = θ₁² e^(−d²/2) e^(−d η x) e^(−η² x²/2), where η depends on the box only. So
Σ_i c_i κ(r_i + h x) = θ₁² e^(−η² x²/2) Σ_k S_k xᵏ with S_k = Σ_i c_i e^(−d_i²/2) (−d_i η)ᵏ/k!.
"""

from functools import cache, lru_cache
from math import factorial

import numpy as np

from trackable.arrays import Array
from trackable.certificates.boxes.boxes import Boxes, Indices
from trackable.certificates.boxes.nearby import Pairs
from trackable.certificates.floats.balls import TINY, Balls, U, sums_up
from trackable.certificates.floats.series import exponential_terms
from trackable.certificates.kernels.squared_exponential import SquaredExponentialBalls


def sums(kernel: SquaredExponentialBalls, of: Pairs, terms: int) -> Balls:
    """Return S_k for all k < terms: shape (terms, B).

    With w = e^(−d²/2) within ω of ŵ, x = −d η within ρ of x̂ and s ≥ |x̂| + ρ, each c w xᵏ is within
    |c| ω sᵏ + |c| (ŵ + ω) ρ k s^(k − 1) of c ŵ x̂ᵏ. This takes k + 1 roundings, its sum one for each centre, and the
    division by k! two more: no more than κ u |c| ŵ sᵏ. So three products grow with k, of which the last two are bounds.
    What underflows is less than 2⁻¹⁰⁷⁴, and grows by no more than sᵏ or 1: TINY sᵏ in the second and the TINY of
    `sums_up` are larger.
    """
    d, eta = of.differences * _per_length(kernel), of.boxes.halves * _per_length(kernel)
    w, x = (d * d * -0.5).exp(), d * eta.at(of.of_box)
    c, kappa = np.abs(of.weights), (terms + of.most + 8) * U
    products = np.stack([of.weights * w.mid, c * (w.rad + kappa * w.mid) + TINY, c * w.size * x.rad])
    factors = np.stack([-x.mid, x.size, x.size])
    found = np.empty((terms, 3, len(of.boxes)))
    for k in range(terms):
        found[k] = of.summed(products)
        products *= factors
    found *= _inverse_factorials(terms)[:, None, None]
    mid, rad, propagated = found.swapaxes(0, 1)
    rad[1:] += propagated[:-1]  # k/k! = 1/(k − 1)!
    return Balls(mid, sums_up(rad, 2 * terms + of.most))


def size_on_discs(kernel: SquaredExponentialBalls, of: Pairs) -> Array:
    """Bound Σ_i |c_i| |κ(z_i)| over |z_i − r_i| ≤ ρ in each box, where Re z² ≥ r²/2 − ρ²: shape (B,)."""
    per_length, boxes = _per_length(kernel), of.boxes
    least = np.maximum(abs(of.differences).lowest, 0.0) * per_length.lowest
    most = boxes.radii * per_length.highest
    exponents = (most * most * (0.5 * (1 + 8 * U)))[of.of_box] - least * least * (0.25 * (1 - 8 * U))
    sizes = np.exp(exponents + _SPARE) + TINY
    return sums_up(of.summed_up(sizes) * _variance(kernel).highest, 1)


def polynomial(kernel: SquaredExponentialBalls, weighted: Balls, boxes: Boxes) -> Balls:
    """Return Σ_i c_i κ(r_i + h x) as a polynomial in x, from its S_k: shape (terms, B)."""
    terms = len(weighted.mid)
    eta = boxes.halves * _per_length(kernel)
    even = exponential_terms(eta * eta * -0.5, (terms + 1) // 2)
    factors = Balls(*(np.concatenate([x, np.zeros((1, len(boxes)))])[_places(terms)] for x in (even.mid, even.rad)))
    size, whole = np.abs(weighted.mid), np.abs(weighted.mid) + weighted.rad
    rounded = weighted.rad + (terms + 4) * U * size
    mid = np.sum(factors.mid * weighted.mid, axis=1)
    rad = np.sum(np.abs(factors.mid) * rounded + factors.rad * whole, axis=1)
    return Balls(mid, sums_up(rad, 2 * terms)) * _variance(kernel)


_SPARE = 2.0**-38
"""More than what rounding takes from an exponent where e^x is finite, and from e^x."""


@lru_cache
def _variance(kernel: SquaredExponentialBalls) -> Balls:
    """θ₁²."""
    return Balls.of(kernel.variance)


@lru_cache
def _per_length(kernel: SquaredExponentialBalls) -> Balls:
    """1/θ₂."""
    return Balls.of(1) / kernel.length


@cache
def _inverse_factorials(terms: int) -> Array:
    """Return 1/k! for all k < terms, rounded."""
    return np.array([1 / factorial(k) for k in range(terms)])


@cache
def _places(terms: int) -> Indices:
    """Return which coefficient of e^(−η² x²/2) multiplies S_j in the coefficient of xᵏ: shape (k, j); the last is 0."""
    apart = np.subtract.outer(np.arange(terms), np.arange(terms))
    return np.where((apart >= 0) & (apart % 2 == 0), apart // 2, (terms + 1) // 2)
