"""The squared exponential kernel."""

import math

import numpy as np

from trackably.arrays import Array
from trackably.gp.kernels.elementary import Radial


class SquaredExponential(Radial):
    """φ(s) = exp(−s²/2) with s = r/θ₂ and the length scale θ₂."""

    def correlation(self, s: Array, order: int) -> Array:
        phi = np.empty((order + 1, *s.shape))
        phi[0] = np.exp(-0.5 * s**2)
        for n in range(order):  # φ' = −s φ, differentiated n times
            phi[n + 1] = -s * phi[n]
            if n:
                phi[n + 1] -= n * phi[n - 1]
        return phi

    def extent(self, exponent: float) -> float:
        return self.lengthscale * math.sqrt(2 * exponent)
