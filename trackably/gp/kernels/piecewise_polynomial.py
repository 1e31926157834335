"""Piecewise polynomial kernels with compact support, positive definite on a line (one dimension).

C. E. Rasmussen and C. K. I. Williams, Gaussian Processes for Machine Learning, 2006, eq. (4.21) with D = 1. There, q is
the smoothness.
"""

from functools import cache
from typing import ClassVar

import numpy as np
from numpy.polynomial import Polynomial
from numpy.polynomial.polynomial import polyval

from trackably.arrays import Array
from trackably.gp.kernels.elementary import Radial


class _PiecewisePolynomial(Radial):
    """φ(s) = (1 − |s|)ᵖ Q(|s|) for |s| < 1, and zero elsewhere, with s = r/θ₂, the `power` p and the `polynomial` Q.

    Instants θ₂ or more apart are uncorrelated: a signal of this kernel equals its prior mean when θ₂ has passed since
    its last centre, so it comes to rest after a finite time.

    n < p derivatives turn (1 − s)ᵖ Q into (1 − s)ᵖ⁻ⁿ Q_n with Q_(n+1) = (1 − s) Q_n' − (p − n) Q_n. Where a derivative
    jumps, at s = 0 or |s| = 1, the mean of both sides is returned.
    """

    power: ClassVar[int]
    polynomial: ClassVar[Polynomial]

    @property
    def is_analytic(self) -> bool:
        return False

    def extent(self, exponent: float) -> float:
        return self.lengthscale

    def correlation(self, s: Array, order: int) -> Array:
        distance = np.abs(s)
        x = np.minimum(distance, 1.0)
        factors = _factors(self.power, tuple(self.polynomial.coef.tolist()), order)
        powers = range(self.power, self.power - order - 1, -1)
        falls = ((1 - x) ** n if n > 0 else np.heaviside(1 - distance, 0.5) for n in powers)
        phi = np.array([polyval(x, factor) * fall for factor, fall in zip(factors, falls, strict=True)])
        phi[1::2] *= np.sign(s)  # φ is even: its odd derivatives are odd
        return phi


@cache
def _factors(power: int, polynomial: tuple[float, ...], order: int) -> list[list[float]]:
    """Return the coefficients of Q_n for n = 0 … `order`: the n-th derivative of (1 − s)ᵖ Q is (1 − s)ᵖ⁻ⁿ Q_n.

    p is the `power`, and `polynomial` has the coefficients of Q, by increasing powers of s. For n ≥ p, Q_n is the n-th
    derivative itself.
    """
    factor, found = Polynomial(polynomial), []
    for n in range(order + 1):
        found.append(factor.coef.tolist())
        left = max(power - n, 0)
        factor = Polynomial([1, -1]) * factor.deriv() - left * factor if left else factor.deriv()
    return found


class PiecewisePolynomial2(_PiecewisePolynomial):
    """φ(s) = (1 − s)⁵ (8 s² + 5 s + 1) for 0 ≤ s = |r|/θ₂ < 1; the mean has four continuous derivatives."""

    power = 5
    polynomial = Polynomial([1, 5, 8])


class PiecewisePolynomial3(_PiecewisePolynomial):
    """φ(s) = (1 − s)⁷ (21 s³ + 19 s² + 7 s + 1) for 0 ≤ s = |r|/θ₂ < 1; the mean has six continuous derivatives."""

    power = 7
    polynomial = Polynomial([1, 7, 19, 21])
