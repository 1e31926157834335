"""The rational quadratic kernel."""

import math
from dataclasses import dataclass

import numpy as np

from trackably.arrays import Array
from trackably.gp.hyperparameter import Hyperparameter, amplitude, duration, tail_weight
from trackably.gp.kernels.elementary import Radial


@dataclass(frozen=True, repr=False)
class RationalQuadratic(Radial):
    """φ(s) = (1 + s²/(2α))^(−α) with s = r/θ₂, the length scale θ₂ and the hyperparameter `shape` α.

    It is a mixture of squared exponentials of many length scales.
    """

    signal_std: Hyperparameter = Hyperparameter(amplitude)
    lengthscale: Hyperparameter = Hyperparameter(duration)
    shape: Hyperparameter = Hyperparameter(tail_weight)

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
        """Return ψ = ∂φ/∂ln α and its derivatives in s: the recursion of φ, differentiated by ln α."""
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
    def correlation_time(self) -> float:
        """√(3 |κ̈(0)|/κ⁗(0)) [s]: the time scale on which a signal bends; it is shorter for smaller α.

        Beyond θ₂ √(2α), Taylor series diverge: for small α, this is far below θ₂ = √(κ(0)/|κ̈(0)|).
        """
        return self.lengthscale * math.sqrt(self.shape / (self.shape + 1))
