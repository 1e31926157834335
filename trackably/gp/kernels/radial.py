"""Kernels that decay with distance, κ(r) = θ₁² φ(r/θ₂): each states φ and its derivatives, nothing more."""

from abc import abstractmethod
from dataclasses import dataclass

import numpy as np

from trackably.arrays import Array
from trackably.gp.hyperparameter import Hyperparameter, amplitude, duration
from trackably.gp.kernels.elementary import Elementary
from trackably.gp.kernels.jets import stretched

UNDERFLOW = 746.0
"""e^(−x) is zero in float64 for every x beyond."""

NEGLIGIBLE = 56.0
"""e^(−x) is below 2⁻⁸⁰ for every x beyond, and below 2⁻⁶⁰ after multiplication with the polynomials of derivatives."""


@dataclass(frozen=True, repr=False)
class Radial(Elementary):
    """κ(r) = θ₁² φ(r/θ₂) with `signal_std` θ₁ (the unit of the signal) and `lengthscale` θ₂ [s]."""

    signal_std: Hyperparameter = Hyperparameter(amplitude)
    lengthscale: Hyperparameter = Hyperparameter(duration)

    @abstractmethod
    def correlation(self, s: Array, order: int) -> Array:
        """Return φ and its derivatives up to `order` at s, in length scales: shape (order + 1, *s.shape)."""

    def jet(self, r: Array, order: int) -> Array:
        return self._in_time(self.correlation(r / float(self.lengthscale), order))

    def jet_and_gradient(self, r: Array, order: int) -> tuple[Array, Array]:
        jet = self.jet(r, order + 1)
        gradient = np.empty((2, *jet[:-1].shape))
        np.multiply(jet[:-1], 2.0, out=gradient[0])
        gradient[1] = stretched(jet, r)
        return jet[:-1], gradient

    def _in_time(self, correlation: Array) -> Array:
        variance, lengthscale = float(self.signal_std) ** 2, float(self.lengthscale)
        by_order = correlation.T
        by_order *= [variance / lengthscale**n for n in range(len(correlation))]
        return correlation
