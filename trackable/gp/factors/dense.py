"""Samples at any times: the Cholesky factor of the whole matrix."""

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
import scipy

from trackable.arrays import Array
from trackable.gp.factors.factorisation import Block, Covariance, Factorisation
from trackable.gp.factors.gram import Gram, Strips, gram, gram_of_blocks


@dataclass(frozen=True)
class Dense(Factorisation):
    """A = L Lᵀ with the `factor` L (n, n) of LAPACK: lower triangle, Fortran order; entries above it are undefined.

    The inverse is computed in `workspace`, of the same shape and order.
    """

    factor: Array
    workspace: Array
    gradient: Strips
    noise_variance: Array

    @classmethod
    def of(cls, times: Array, covariance: Covariance, noise_variance: Array) -> Self | None:
        """Factorise for n `times` [s] and noise variances (n,); None if A is not positive definite in float64."""
        return cls._of(gram(times, covariance), noise_variance)

    @classmethod
    def of_blocks(cls, block: Block, noise_variance: Array) -> Self | None:
        """Factorise for any covariance of n samples, given by blocks; None as above."""
        return cls._of(gram_of_blocks(len(noise_variance), block), noise_variance)

    @classmethod
    def _of(cls, found: Gram, noise_variance: Array) -> Self | None:
        upper, workspace, gradient = found
        upper.reshape(-1)[:: len(noise_variance) + 1] += noise_variance
        factor, info = scipy.linalg.lapack.dpotrf(upper.T, lower=True, clean=False, overwrite_a=True)
        return None if info else cls(factor, workspace.T, gradient, noise_variance)

    @cached_property
    def log_determinant(self) -> float:
        return 2 * float(np.log(self.factor.diagonal()).sum())

    def solve(self, right: Array) -> Array:
        solution, _ = scipy.linalg.lapack.dpotrs(self.factor, right, lower=True)
        return np.asarray(solution.reshape(right.shape))

    def gradient_times(self, c: Array) -> Array:
        return self.gradient.times(c)

    def likelihood_traces(self, c: Array) -> tuple[Array, float]:
        self.workspace[...] = self.factor
        inverse, _ = scipy.linalg.lapack.dpotri(self.workspace, lower=True, overwrite_c=True)
        difference = scipy.linalg.blas.dsyr(-1.0, c, a=inverse, lower=True, overwrite_a=True)  # A⁻¹ − c cᵀ
        return self.gradient.traces(difference.T), float(difference.diagonal() @ self.noise_variance)
