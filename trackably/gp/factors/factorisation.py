"""The interface of a factorised covariance matrix: factor once, then solve often."""

from abc import ABC, abstractmethod

import numpy as np
import scipy

from trackably.arrays import Array


def cholesky_solve(factor: Array, right: Array) -> Array:
    """Return (L Lᵀ)⁻¹ r for a lower triangular `factor` L (n, n), and r of shape (n,) or (n, m)."""
    solution, _ = scipy.linalg.lapack.dpotrs(factor, right, lower=True)
    return np.asarray(solution.reshape(right.shape))


class Factorisation(ABC):
    """A = K + V, factorised: the covariance K of n samples, with p hyperparameters, and diagonal noise V."""

    @property
    @abstractmethod
    def log_determinant(self) -> float:
        """The logarithm of the determinant, ln|A|."""

    @abstractmethod
    def solve(self, right: Array) -> Array:
        """Return A⁻¹ r for one r of shape (n,), or for each column of an (n, m) array."""

    @abstractmethod
    def gradient_times(self, c: Array) -> Array:
        """Return (∂K/∂ln θ_j) c for c of shape (n,); the shape is (p, n)."""

    @abstractmethod
    def likelihood_traces(self, c: Array) -> tuple[Array, float]:
        """Return tr((A⁻¹ − c cᵀ) ∂K/∂ln θ_j), shape (p,), and tr((A⁻¹ − c cᵀ) V), for c of shape (n,).

        With c = A⁻¹ (y − m) for samples y with prior mean m, they are the derivatives by ln θ_j, and by the logarithm
        of the noise variance, of l: minus twice the log marginal likelihood.
        """
