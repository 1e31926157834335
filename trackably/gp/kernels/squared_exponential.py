"""The squared exponential kernel."""

import math

import numpy as np

from trackably.arrays import Array
from trackably.gp.kernels.base import SpectralDensity
from trackably.gp.kernels.elementary import Radial

_EXTENT = 8.2  # e^(−s²/2) is at rounding level for every s beyond this, and so is its integral


class SquaredExponential(Radial):
    """φ(s) = exp(−s²/2) with s = r/θ₂ and the length scale θ₂."""

    def correlation(self, s: Array, order: int) -> Array:
        phi, minus = np.empty((order + 1, *s.shape)), -s
        square = s * s
        square *= -0.5
        np.exp(square, out=phi[0, ...])
        for n in range(order):  # φ' = −s φ, differentiated n times
            np.multiply(minus, phi[n], out=phi[n + 1, ...])
            if n:
                phi[n + 1] -= n * phi[n - 1]
        return phi

    @property
    def spectral_density(self) -> SpectralDensity:
        """S = √(2π) θ₁² θ₂ e^(−s²/2) with s = θ₂ ω: a squared exponential again."""
        variance, lengthscale = float(self.signal_std) ** 2, float(self.lengthscale)
        return SpectralDensity(variance, _EXTENT * lengthscale, _EXTENT / lengthscale, self._density)

    def _density(self, omega: Array) -> tuple[Array, Array]:
        square = (float(self.lengthscale) * omega) ** 2
        gradient = np.empty((2, len(omega)))
        gradient[0], gradient[1] = 2, 1 - square
        return math.sqrt(math.tau) * float(self.signal_std) ** 2 * self.lengthscale * np.exp(-0.5 * square), gradient

    def extent(self, exponent: float) -> float:
        return self.lengthscale * math.sqrt(2 * exponent)
