"""Matérn kernels of half-integer smoothness ν."""

import math
from functools import cache, cached_property
from typing import ClassVar

import numpy as np
from numpy.polynomial import Polynomial
from numpy.polynomial.polynomial import polyval

from trackably.arrays import Array
from trackably.gp.kernels.base import Decay
from trackably.gp.kernels.elementary import Radial


class Matern(Radial):
    """φ(s) = P(x) e^(−x) with x = √(2ν) |s|; n derivatives in x turn P into (d/dx − 1)ⁿ P."""

    rate: ClassVar[float]
    polynomial: ClassVar[Polynomial]

    @property
    def is_analytic(self) -> bool:
        return False

    def extent(self, exponent: float) -> float:
        return self.lengthscale * exponent / self.rate

    @cached_property
    def decays(self) -> tuple[Decay, ...]:
        """κ = θ₁² P(x) e^(−x) with x = λ|r|, ∂κ/∂ln θ₁ = 2 κ and ∂κ/∂ln θ₂ = −r κ̇ = −θ₁² x (P' − P) e^(−x)."""
        by_length = Polynomial([0, 1]) * (self.polynomial - self.polynomial.deriv())
        rows = np.zeros((3, len(by_length)))
        rows[:2, :-1] = self.polynomial.coef
        rows[1] *= 2
        rows[2] = by_length.coef
        return (Decay(self.rate / self.lengthscale, self.signal_std**2 * rows),)

    def correlation(self, s: Array, order: int) -> Array:
        x = self.rate * np.abs(s)
        decay = np.exp(-x)
        every = enumerate(_factors(type(self), order))
        phi = np.array([polyval(x, coefficients) * decay * self.rate**n for n, coefficients in every])
        phi[1::2] *= np.sign(s)  # φ is even: its odd derivatives are odd
        return phi


@cache
def _factors(kernel: type[Matern], order: int) -> list[list[float]]:
    """Return the coefficients of (d/dx − 1)ⁿ P for n = 0 … order."""
    return [
        factor.tolist() for factor in Decay(1.0, np.array([kernel.polynomial.coef], dtype=float)).derivatives(order)
    ]


class Matern32(Matern):
    """φ(s) = (1 + x) e^(−x), with x = √3 |s|, s = r/θ₂ and the length scale θ₂.

    The mean has two continuous derivatives, and a third one that jumps at samples. At 0, where the third derivative
    jumps, the jet has the midpoint, 0.
    """

    rate = math.sqrt(3)
    polynomial = Polynomial([1, 1])


class Matern52(Matern):
    """φ(s) = (1 + x + x²/3) e^(−x), with x = √5 |s|, s = r/θ₂ and the length scale θ₂."""

    rate = math.sqrt(5)
    polynomial = Polynomial([1, 1, 1 / 3])


class Matern72(Matern):
    """φ(s) = (1 + x + 2x²/5 + x³/15) e^(−x), with x = √7 |s|, s = r/θ₂ and the length scale θ₂.

    The mean has six continuous derivatives; its jerk is bounded.
    """

    rate = math.sqrt(7)
    polynomial = Polynomial([1, 1, 2 / 5, 1 / 15])
