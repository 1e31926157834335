"""Samples at any times: the Cholesky factor of the whole matrix."""

from dataclasses import dataclass
from typing import Self

import numpy as np
import scipy

from trackably.arrays import Array
from trackably.gp.factors.factorisation import Factorisation, cholesky_solve


@dataclass(frozen=True)
class Dense(Factorisation):
    """A = K + V = L Lᵀ, covariance plus noise: `factor` L, zero above its diagonal; `gradient` ∂K/∂ln θ_j (p, n, n)."""

    factor: Array
    gradient: Array
    noise_variance: Array

    @classmethod
    def of(cls, covariance: Array, gradient: Array, noise_variance: Array) -> Self | None:
        """Factorise A = K + V with the `covariance` K, and n noise variances; None if A is not positive definite."""
        covariance.reshape(-1)[:: len(covariance) + 1] += noise_variance
        factor, info = scipy.linalg.lapack.dpotrf(covariance.T, lower=True, overwrite_a=True)
        return None if info else cls(factor, gradient, noise_variance)

    @property
    def log_determinant(self) -> float:
        return 2 * float(np.add.reduce(np.log(self.factor.diagonal())))

    def solve(self, right: Array) -> Array:
        return cholesky_solve(self.factor, right)

    def gradient_times(self, c: Array) -> Array:
        return np.asarray(self.gradient @ c)

    def likelihood_traces(self, c: Array) -> tuple[Array, float]:
        inverse, _ = scipy.linalg.lapack.dpotri(self.factor, lower=True)  # A⁻¹ on and below the diagonal, else zero
        diagonal = inverse.diagonal().copy()
        twice = 2 * inverse.T.reshape(-1)  # an entry below the diagonal stands for two
        twice[:: len(c) + 1] = diagonal
        by_kernel = self.gradient.reshape(len(self.gradient), -1) @ twice - self.gradient_times(c) @ c
        return np.asarray(by_kernel), float((diagonal - c**2) @ self.noise_variance)
