"""The periodic kernel, in its correct form: the paper prints the square inside the sine."""

from dataclasses import dataclass
from math import comb, tau

import numpy as np

from trackably.arrays import Array
from trackably.gp.hyperparameter import Hyperparameter, amplitude, fraction_of_period, repetition
from trackably.gp.kernels.base import lengthscale_gradient
from trackably.gp.kernels.elementary import Elementary


@dataclass(frozen=True, repr=False)
class Periodic(Elementary):
    """κ(r) = θ₁² exp(−(2/θ₂²) sin²(π r/θ₃)) with `signal_std` θ₁, `lengthscale` θ₂ (no unit) and `period` θ₃ [s]."""

    signal_std: Hyperparameter = Hyperparameter(amplitude)
    lengthscale: Hyperparameter = Hyperparameter(fraction_of_period)
    period: Hyperparameter = Hyperparameter(repetition)

    def jet(self, r: Array, order: int) -> Array:
        return np.asarray(self._jets(r, order)[0])

    def jet_and_gradient(self, r: Array, order: int) -> tuple[Array, Array]:
        jet, detour = self._jets(r, order + 1)
        gradient = np.empty((3, *jet[:-1].shape))
        gradient[0] = 2 * jet[:-1]
        for n in range(order + 1):  # ∂κ/∂ln θ₂ = 2 g κ with g = −ln(κ/θ₁²), differentiated n times
            gradient[1, n] = 2 * detour[n] * jet[0]
            for j in range(1, n + 1):
                gradient[1, n] += 2 * comb(n, j) * detour[n - j] * jet[j]
        gradient[2] = lengthscale_gradient(jet, r)
        return jet[:-1], gradient

    def _jets(self, r: Array, order: int) -> tuple[Array, Array]:
        """Return κ = θ₁² e^(−g) and g = 2 sin²(ωr/2)/θ₂² = (1 − cos ωr)/θ₂² with ω = 2π/θ₃, each with its derivatives.

        Both arrays have the derivatives in r up to `order`, shape (order + 1, *r.shape).
        """
        omega, beta = tau / self.period, self.lengthscale**-2
        phase = omega / 2 * r
        sine = np.sin(phase)
        g, kappa = np.empty((2, order + 1, *r.shape))
        g[0] = 2 * beta * sine**2
        if order:
            g[1] = 2 * beta * omega * sine * np.cos(phase)
        for n in range(2, order + 1):  # g'' = ω² (1/θ₂² − g)
            g[n] = omega**2 * ((beta if n == 2 else 0) - g[n - 2])
        kappa[0] = self.signal_std**2 * np.exp(-g[0])
        for n in range(order):  # κ' = −g' κ, differentiated n times
            kappa[n + 1] = 0.0 - g[n + 1] * kappa[0]
            for j in range(1, n + 1):
                kappa[n + 1] -= comb(n, j) * g[n - j + 1] * kappa[j]
        return kappa, g
