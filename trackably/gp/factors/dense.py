"""Samples at any times: the Cholesky factor of the whole matrix."""

from dataclasses import dataclass
from typing import Self

import numpy as np
import scipy

from trackably.arrays import Array
from trackably.gp.factors.factorisation import LOWER, Entries, Factorisation, diagonal, gram, products


@dataclass(frozen=True)
class Dense(Factorisation):
    """A = L Lᵀ with the N stored entries of the triangular `factor` L, and of the `gradient` ∂K/∂ln θ_j, (p, N)."""

    factor: Array
    gradient: Array
    noise_variance: Array

    @classmethod
    def of(cls, entries: Entries, noise_variance: Array) -> Self | None:
        """Factorise A = K + V with the `entries` of K, and n noise variances; None if A is not positive definite."""
        n = len(noise_variance)
        covariance, gradient = gram(n, entries)
        covariance[diagonal(n)] += noise_variance
        factor, info = scipy.linalg.lapack.dpftrf(n, covariance, uplo=LOWER, overwrite_a=True)
        return None if info else cls(factor, gradient, noise_variance)

    @property
    def log_determinant(self) -> float:
        return 2 * float(np.add.reduce(np.log(self.factor[diagonal(len(self.noise_variance))])))

    def solve(self, right: Array) -> Array:
        solution, _ = scipy.linalg.lapack.dpftrs(len(right), self.factor, right, uplo=LOWER)
        return np.asarray(solution.reshape(right.shape))

    def gradient_times(self, c: Array) -> Array:
        return products(self.gradient, c)

    def likelihood_traces(self, c: Array) -> tuple[Array, float]:
        n, lapack = len(c), scipy.linalg.lapack
        inverse, _ = lapack.dpftri(n, self.factor, uplo=LOWER)
        # 2 (A⁻¹ − c cᵀ), as a stored entry stands for two of a symmetric matrix; only those of the diagonal are halved.
        counted = lapack.dsfrk(n, 1, -2.0, c[:, None], 2.0, inverse, uplo=LOWER, overwrite_c=True)
        on_diagonal = 0.5 * counted[diagonal(n)]
        counted[diagonal(n)] = on_diagonal
        by_kernel: Array = self.gradient.dot(counted)  # for small arrays faster than the operator @
        return by_kernel, float(on_diagonal.dot(self.noise_variance))
