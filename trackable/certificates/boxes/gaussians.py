"""Sums of squared exponentials over many centres, by few numbers for each box, since their exponents separate.

With d = r/θ₂ and η = h/θ₂ is κ(r + h x) = θ₁² e^(−d²/2) e^(−d η x) e^(−η² x²/2), where η depends on the box only. So
Σ_i c_i κ(r_i + h x) = θ₁² e^(−η² x²/2) Σ_k S_k xᵏ with S_k = Σ_i c_i e^(−d_i²/2) (−d_i η)ᵏ/k!.
"""

from functools import cache, lru_cache
from math import factorial

import numpy as np

from trackable.arrays import Array
from trackable.certificates.boxes.boxes import Boxes
from trackable.certificates.boxes.nearby import FullPairs, Pairs
from trackable.certificates.floats.balls import FUNCTION, TINY, UP, Balls, U, sums_up
from trackable.certificates.floats.series import exponential_terms
from trackable.certificates.kernels.squared_exponential import SquaredExponentialBalls


def sums(kernel: SquaredExponentialBalls, of: Pairs | FullPairs, terms: int) -> Balls:
    """Return S_k for all k < terms: shape (terms, B).

    With w = e^(−d²/2) within ω of ŵ, x = −d η within ρ of x̂ and s ≥ |x̂| + ρ, each c w xᵏ is within
    |c| ω sᵏ + |c| (ŵ + ω) ρ k s^(k − 1) of c ŵ x̂ᵏ. This takes k + 1 roundings, its sum one for each centre, and the
    division by k! two more: no more than κ u |c| ŵ sᵏ. So three products grow with k, of which the last two are bounds.
    What underflows is less than 2⁻¹⁰⁷⁴, and grows by no more than sᵏ or 1: TINY sᵏ in the second and the TINY of
    `sums_up` are larger.
    """
    d, eta = of.differences * _per_length(kernel), of.boxes.halves * _per_length(kernel)
    w, x = _bell(d), d * Balls(of.of_each(eta.mid), of.of_each(eta.rad))
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


def size_on_discs(kernel: SquaredExponentialBalls, of: Pairs | FullPairs) -> Array:
    """Bound Σ_i |c_i| |κ(z_i)| over |z_i − r_i| ≤ ρ in each box, where Re z² ≥ r²/2 − ρ²: shape (B,)."""
    per_length, boxes = _per_length(kernel), of.boxes
    least = np.maximum(abs(of.differences).lowest, 0.0) * per_length.lowest
    most = boxes.radii * per_length.highest
    exponents = of.of_each(most * most * (0.5 * (1 + 8 * U))) - least * least * (0.25 * (1 - 8 * U))
    sizes = np.exp(exponents + _SPARE) + TINY
    return sums_up(of.summed_up(sizes) * _variance(kernel).highest, 1)


def nearly_on_discs(kernel: SquaredExponentialBalls, r: Array, radii: Array) -> Array:
    """Return θ₁² e^(ρ² − r²/2) with both in length scales, without bounds of its rounding."""
    per_length = _per_length(kernel).mid / np.sqrt(2.0)
    return np.asarray(_variance(kernel).mid * np.exp((radii * per_length) ** 2 - (r * per_length) ** 2 / 2))


def polynomial(kernel: SquaredExponentialBalls, weighted: Balls, boxes: Boxes) -> Balls:
    """Return Σ_i c_i κ(r_i + h x) as a polynomial in x, from its S_k: shape (terms, B)."""
    terms = len(weighted.mid)
    eta = boxes.halves * _per_length(kernel)
    even, size = exponential_terms(eta * eta * -0.5, (terms + 1) // 2), np.abs(weighted.mid)
    parts = np.stack([weighted.mid, weighted.rad + (terms + 4) * U * size, size + weighted.rad])
    found = np.zeros_like(parts)
    for m, of_m in enumerate(np.stack([even.mid, np.abs(even.mid), even.rad], axis=1)[:, :, None]):
        found[:, 2 * m :] += of_m * parts[:, : terms - 2 * m]
    return Balls(found[0], sums_up(found[1] + found[2], 2 * terms)) * _variance(kernel)


def _bell(d: Balls) -> Balls:
    """Return e^(−d²/2).

    With δ the radius and m the middle of d, and the rounding of m², the exponent is within ε = δ (|m| + δ) + u m² of
    the rounded one. Where ε ≤ 1, e^ε − 1 ≤ ε + ε²; and both numbers lie between 0 and 1, up to rounding. What is too
    small for the precision of e^x is smaller than TINY.
    """
    size = np.abs(d.mid)
    square = size * size
    mid, off = np.exp(-0.5 * square), (d.rad * (size + d.rad) + U * square) * UP
    return Balls(mid, np.where(off <= 1, mid * ((off + off * off) * UP + FUNCTION) * UP + TINY, 1.0625))


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
