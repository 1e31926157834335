"""The interface of a factorised covariance matrix: factor once, then solve often."""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
import scipy

from trackably.arrays import Array


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

    def centres(self, times: Array) -> Array:
        """Return the centres [s] of the kernels in the posterior mean: the sample `times` [s], or fewer points."""
        return times

    def weights_at_centres(self, c: Array) -> Array:
        """Convert weights c of the samples, shape (…, n), to weights at `centres`."""
        return c


@dataclass(frozen=True)
class Woodbury(Factorisation):
    """A = K + σ_n² ϱ² with a K of rank m < n, by the Cholesky `factor` L of an (m, m) matrix B = L Lᵀ.

    Sample i has noise of the standard deviation ϱ_i σ_n: `relative_noise` ϱ (n,) and `noise_variance` σ_n². With any U
    and S for which K = σ_n² ϱ U S Uᵀ ϱ, the determinants of I + U S Uᵀ and of B = I + Uᵀ U S are the same.
    """

    relative_noise: Array
    noise_variance: float
    factor: Array

    @property
    def log_determinant(self) -> float:
        of_noise = len(self.relative_noise) * math.log(self.noise_variance) + 2 * np.log(self.relative_noise).sum()
        return float(of_noise + 2 * np.log(self.factor.diagonal()).sum())

    def _solve(self, rows: Array) -> Array:
        """Return B⁻¹ times each of the `rows` (…, m)."""
        solved, _ = scipy.linalg.lapack.dpotrs(self.factor, rows.T, lower=True)
        return np.asarray(solved.T.reshape(rows.shape))
