"""The rational quadratic kernel."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from trackably.arrays import Array
from trackably.gp.hyperparameter import Hyperparameter, amplitude, duration, tail_weight
from trackably.gp.kernels.elementary import Radial

_STEP = 1e-20  # ε of complex steps: ε² is lost beside 1


@dataclass(frozen=True, repr=False)
class RationalQuadratic(Radial):
    """φ(s) = (1 + s²/(2α))^(−α) with s = r/θ₂, the length scale θ₂ and the hyperparameter `shape` α.

    It is a mixture of squared exponentials of many length scales.
    """

    signal_std: Hyperparameter = Hyperparameter(amplitude)
    lengthscale: Hyperparameter = Hyperparameter(duration)
    shape: Hyperparameter = Hyperparameter(tail_weight)

    def correlation(self, s: Array, order: int) -> Array:
        return self._derivatives(s, order, self.shape)

    def jet_and_gradient(self, r: Array, order: int) -> tuple[Array, Array]:
        """Return κ(r) with its derivatives in r up to `order`, and ∂/∂ln θ_j of all of these.

        The derivative by ln α is the imaginary part at α (1 + iε), divided by ε (complex step), because a difference of
        nearly equal numbers would be inaccurate.
        """
        jet, gradient = super().jet_and_gradient(r, order)
        moved = self._derivatives(r / self.lengthscale, order, self.shape * (1 + 1j * _STEP))
        return jet, np.concatenate([gradient, self._in_time(moved.imag / _STEP)[None]])

    def _derivatives(self, s: Array, order: int, alpha: complex) -> npt.NDArray[Any]:
        """Return φ and its derivatives up to `order` at s for the shape α: (order + 1, *s.shape)."""
        q = 1 + s**2 / (2 * alpha)
        phi = np.empty((order + 1, *s.shape), dtype=q.dtype)
        phi[0] = q**-alpha
        for n in range(order):  # q φ' = −s φ, differentiated n times
            phi[n + 1] = -s * (1 + n / alpha) * phi[n] / q
            if n:
                phi[n + 1] -= n * (1 + (n - 1) / (2 * alpha)) * phi[n - 1] / q
        return phi

    @property
    def correlation_time(self) -> float:
        """√(3 |κ̈(0)|/κ⁗(0)) [s]: the time scale on which a signal bends; it is shorter for smaller α.

        Beyond θ₂ √(2α), Taylor series diverge: for small α, this is far below θ₂ = √(κ(0)/|κ̈(0)|).
        """
        return self.lengthscale * math.sqrt(self.shape / (self.shape + 1))
