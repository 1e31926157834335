"""The learned signal: a constant plus a sum of kernels, as plain stored numbers."""

from dataclasses import dataclass

import numpy as np

from pipeline.arrays import Array
from pipeline.gp.kernel import Kernel


@dataclass(frozen=True)
class KernelSum:
    """m⁺(t) = m + Σ_i c_i κ(t − t_i) with `mean` m, `centres` t_i [s] and `weights` c_i (shape (n,) both).

    This is all that a reference is made of: how the weights were found does not matter to any later claim about it.
    """

    kernel: Kernel
    mean: float
    centres: Array
    weights: Array

    def jet(self, t: Array, order: int) -> Array:
        """m⁺ and its time derivatives up to `order` at t [s]: shape (order + 1, *t.shape)."""
        jet = self.kernel.jet(np.asarray(t, dtype=float)[..., None] - self.centres, order) @ self.weights
        jet[0] += self.mean
        return np.asarray(jet)

    def __call__(self, t: Array) -> Array:
        return np.asarray(self.jet(t, 0)[0])

    def derivative(self, t: Array) -> Array:
        return np.asarray(self.jet(t, 1)[1])
