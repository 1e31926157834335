"""Sums of squared exponentials over many centres, by few numbers for each box, since their exponents separate.

With d = r/θ₂ and η = h/θ₂ is κ(r + h x) = θ₁² e^(−d²/2) e^(−d η x) e^(−η² x²/2), where η depends on the box only. So
Σ_i c_i κ(r_i + h x) = θ₁² e^(−η² x²/2) Σ_k S_k xᵏ with S_k = Σ_i c_i e^(−d_i²/2) (−d_i η)ᵏ/k!.
"""

from functools import cache, lru_cache

import numpy as np

from trackable.arrays import Array
from trackable.certificates.boxes.boxes import Boxes, Indices
from trackable.certificates.boxes.mirrored import Mirrored
from trackable.certificates.floats.balls import TINY, Balls, U, sums_up
from trackable.certificates.floats.series import exponential_terms
from trackable.certificates.kernels.squared_exponential import SquaredExponentialBalls


def sums(kernel: SquaredExponentialBalls, of: Mirrored, terms: int) -> Balls:
    """Return S_k for all k < terms: shape (terms, B)."""
    d, eta = of.r * _per_length(kernel), of.pairs.boxes.halves * _per_length(kernel)
    sizes = (d * d * -0.5).exp()
    powers = exponential_terms(d * eta.at(of.pairs.of_box) * -of.signs, terms)
    return of.pairs.weighted(powers * sizes, of.pairs.weights)


def size_on_discs(kernel: SquaredExponentialBalls, of: Mirrored) -> Array:
    """Bound Σ_i |c_i| |κ(z_i)| over |z_i − r_i| ≤ ρ in each box, where Re z² ≥ r²/2 − ρ²: shape (B,)."""
    per_length, boxes = _per_length(kernel), of.pairs.boxes
    least = np.maximum(of.r.lowest, 0.0) * per_length.lowest
    most = boxes.radii * per_length.highest
    exponents = (most * most * (0.5 * (1 + 8 * U)))[of.pairs.of_box] - least * least * (0.25 * (1 - 8 * U))
    sizes = np.exp(exponents + _SPARE) + TINY
    return sums_up(of.pairs.summed_up(sizes) * _variance(kernel).highest, 1)


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
def _places(terms: int) -> Indices:
    """Return which coefficient of e^(−η² x²/2) multiplies S_j in the coefficient of xᵏ: shape (k, j); the last is 0."""
    apart = np.subtract.outer(np.arange(terms), np.arange(terms))
    return np.where((apart >= 0) & (apart % 2 == 0), apart // 2, (terms + 1) // 2)
