"""Kernels that decay with distance, κ(r) = θ₁² φ(r/θ₂): each states φ and its derivatives, nothing more."""

import math
from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.polynomial import Polynomial

from trackable.arrays import Array
from trackable.gp.kernels.base import UNDERFLOW, Elementary, stretched


@dataclass(frozen=True)
class Radial(Elementary):
    """κ(r) = θ₁² φ(r/θ₂) with `signal_std` θ₁ (the unit of the signal) and `lengthscale` θ₂ [s]."""

    signal_std: float
    lengthscale: float

    @abstractmethod
    def correlation(self, s: Array, order: int) -> Array:
        """φ(s) and its derivatives up to `order`, for the distance s in length scales: shape (order + 1, *s.shape)."""

    def jet(self, r: Array, order: int) -> Array:
        return self._in_time(self.correlation(r / self.lengthscale, order))

    def jet_and_gradient(self, r: Array, order: int) -> tuple[Array, Array]:
        jet = self.jet(r, order + 1)
        gradient = np.empty((2, *jet[:-1].shape))
        np.multiply(jet[:-1], 2, out=gradient[0])
        gradient[1] = stretched(jet, r)
        return jet[:-1], gradient

    def _in_time(self, correlation: Array) -> Array:
        for n in range(len(correlation)):
            correlation[n] *= self.signal_std**2 / self.lengthscale**n
        return correlation


@dataclass(frozen=True)
class SquaredExponential(Radial):
    """φ(s) = exp(−s²/2).

    |φ'| = s e^(−s²/2) has the slope (1 − s²) e^(−s²/2), negative from s = 1 on: ζ = θ₂, as the paper says.
    """

    def correlation(self, s: Array, order: int) -> Array:
        phi = np.empty((order + 1, *s.shape))
        np.exp(s * s * -0.5, out=phi[0, ...])
        for n in range(order):  # φ' = −s φ, differentiated n times
            phi[n + 1] = -s * phi[n]
            if n:
                phi[n + 1] -= n * phi[n - 1]
        return phi

    @property
    def decay_distance(self) -> float:
        return self.lengthscale

    @property
    def vanishing_distance(self) -> float:
        return self.lengthscale * math.sqrt(2 * UNDERFLOW)


@dataclass(frozen=True)
class _Matern(Radial):
    """φ(s) = P(x) e^(−x) with x = √(2ν) |s|; n derivatives in x turn P into (d/dx − 1)ⁿ P."""

    rate: ClassVar[float]
    polynomial: ClassVar[Polynomial]

    @property
    def is_analytic(self) -> bool:
        return False

    @property
    def vanishing_distance(self) -> float:
        return self.lengthscale * UNDERFLOW / self.rate

    def correlation(self, s: Array, order: int) -> Array:
        x = self.rate * np.abs(s)
        decay = np.exp(-x)
        phi, factor = np.empty((order + 1, *s.shape)), self.polynomial
        for n in range(order + 1):
            side = np.sign(s) if n % 2 else 1.0  # φ is even: its odd derivatives are odd
            phi[n] = side * self.rate**n * factor(x) * decay
            factor = factor.deriv() - factor
        return phi


@dataclass(frozen=True)
class Matern32(_Matern):
    """φ(s) = (1 + x) e^(−x), x = √3 |s|: the mean has two continuous derivatives, and a third that jumps at samples.

    |φ'| ∝ x e^(−x) has the slope (1 − x) e^(−x), negative from x = 1 on: ζ = θ₂/√3. Where the third derivative
    jumps, at 0, the jet holds the midpoint, 0.
    """

    rate = math.sqrt(3)
    polynomial = Polynomial([1, 1])

    @property
    def decay_distance(self) -> float:
        return self.lengthscale / math.sqrt(3)


@dataclass(frozen=True)
class Matern52(_Matern):
    """φ(s) = (1 + x + x²/3) e^(−x), x = √5 |s|.

    |φ'| ∝ (x + x²) e^(−x) has the slope (1 + x − x²) e^(−x), negative from the golden ratio on: ζ = θ₂ (1 + √5)/(2√5).
    """

    rate = math.sqrt(5)
    polynomial = Polynomial([1, 1, 1 / 3])

    @property
    def decay_distance(self) -> float:
        return self.lengthscale * (1 + math.sqrt(5)) / (2 * math.sqrt(5))


@dataclass(frozen=True)
class RationalQuadratic(Radial):
    """φ(s) = (1 + s²/(2α))^(−α), with the hyperparameter `shape` α: squared exponentials of many length scales.

    With q = 1 + s²/(2α), |φ'| = s q^(−α−1) has the slope q^(−α−2) (1 − s² (2α + 1)/(2α)), negative from
    s = √(2α/(2α + 1)) on: ζ = θ₂ √(2α/(2α + 1)).
    """

    shape: float

    def correlation(self, s: Array, order: int) -> Array:
        alpha = self.shape
        q = 1 + s**2 / (2 * alpha)
        phi = np.empty((order + 1, *s.shape))
        phi[0] = q**-alpha
        for n in range(order):  # q φ' = −s φ, differentiated n times
            phi[n + 1] = -s * (1 + n / alpha) * phi[n] / q
            if n:
                phi[n + 1] -= n * (1 + (n - 1) / (2 * alpha)) * phi[n - 1] / q
        return phi

    def jet_and_gradient(self, r: Array, order: int) -> tuple[Array, Array]:
        jet, gradient = super().jet_and_gradient(r, order)
        s = r / self.lengthscale
        by_shape = self._in_time(self._shape_gradient(s, self.correlation(s, order)))
        return jet, np.concatenate([gradient, by_shape[None]])

    def _shape_gradient(self, s: Array, phi: Array) -> Array:
        """ψ = ∂φ/∂ln α and its derivatives in s: the recursion of φ, differentiated once more, by ln α."""
        alpha = self.shape
        q = 1 + s**2 / (2 * alpha)
        psi = np.empty_like(phi)
        psi[0] = alpha * phi[0] * ((q - 1) / q - np.log(q))
        for n in range(len(phi) - 1):
            psi[n + 1] = ((q - 1) * phi[n + 1] + n * s / alpha * phi[n] - s * (1 + n / alpha) * psi[n]) / q
            if n:
                psi[n + 1] += (
                    n * (n - 1) / (2 * alpha) * phi[n - 1] - n * (1 + (n - 1) / (2 * alpha)) * psi[n - 1]
                ) / q
        return psi

    @property
    def decay_distance(self) -> float:
        return self.lengthscale * math.sqrt(2 * self.shape / (2 * self.shape + 1))
