"""The periodic kernel (as corrected: the paper prints the square inside the sine)."""

import math
from dataclasses import dataclass
from math import comb, tau

import numpy as np

from pipeline.arrays import Array
from pipeline.gp.kernel import Elementary, stretched


@dataclass(frozen=True)
class Periodic(Elementary):
    """κ(r) = θ₁² exp(−(2/θ₂²) sin²(π r/θ₃)) with `signal_std` θ₁, `lengthscale` θ₂ (no unit) and `period` θ₃ [s]."""

    signal_std: float
    lengthscale: float
    period: float

    def jet(self, r: Array, order: int) -> Array:
        return np.asarray(self._jets(r, order)[0])

    def jet_and_gradient(self, r: Array, order: int) -> tuple[Array, Array]:
        jet, detour = self._jets(r, order + 1)
        by_lengthscale = np.stack(
            [2 * sum(comb(n, j) * detour[n - j] * jet[j] for j in range(n + 1)) for n in range(order + 1)]
        )
        return jet[:-1], np.stack([2 * jet[:-1], by_lengthscale, stretched(jet, r)])

    def _jets(self, r: Array, order: int) -> tuple[Array, Array]:
        """The jet of κ = θ₁² e^(−g), and that of its exponent g = (1 − cos ωr)/θ₂², where 2 sin²(ωr/2) = 1 − cos ωr."""
        omega, beta = tau / self.period, self.lengthscale**-2
        g = np.stack([-beta * omega**n * np.cos(omega * r + n * math.pi / 2) for n in range(order + 1)])
        g[0] = 2 * beta * np.sin(omega * r / 2) ** 2
        kappa = np.empty_like(g)
        kappa[0] = self.signal_std**2 * np.exp(-g[0])
        for n in range(order):  # κ' = −g' κ, differentiated n times
            kappa[n + 1] = -sum(comb(n, j) * g[n - j + 1] * kappa[j] for j in range(n + 1))
        return kappa, g

    @property
    def decay_distance(self) -> float:
        return math.inf
