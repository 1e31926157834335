"""The squared exponential kernel."""

import math

import numpy as np

from trackable.arrays import Array
from trackable.gp.kernels.radial import NEGLIGIBLE, UNDERFLOW, Radial


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

    @property
    def negligible_distance(self) -> float:
        return self.lengthscale * math.sqrt(2 * NEGLIGIBLE)
