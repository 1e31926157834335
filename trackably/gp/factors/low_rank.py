"""Smooth kernels: K = W C Wᵀ, where C is the covariance of m Chebyshev points and m may be much smaller than n.

This holds up to rounding if the Chebyshev coefficients of the covariance fall below rounding. W interpolates from the
points to the n sample times and does not depend on the hyperparameters. W is orthogonalised once; then every matrix
that depends on the hyperparameters has size m.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
import scipy

from trackably.arrays import Array
from trackably.gp.factors.chebyshev import Basis
from trackably.gp.factors.factorisation import Covariance, Factorisation
from trackably.gp.factors.gram import gram
from trackably.gp.factors.packed import Symmetric, packed, whole


@dataclass(frozen=True)
class LowRank(Factorisation):
    """A = ϱ (σ_n² I + Q R C Rᵀ Qᵀ) ϱ with noise ϱ_i σ_n of sample i, by the `factor` L of B = I + R C Rᵀ/σ_n² = L Lᵀ.

    B is of size m.
    """

    basis: Basis
    relative_noise: Array
    noise_variance: float
    factor: Array
    gradient: Symmetric

    @classmethod
    def of(cls, basis: Basis, covariance: Covariance, relative_noise: Array, noise_variance: float) -> Self | None:
        """Factorise for σ_n² = `noise_variance`; None if B is not positive definite in float64."""
        m = len(basis.points)
        between, gradient = gram(m, lambda part: covariance(basis.apart[part]))
        b = basis.r @ whole(m, between) @ basis.r.T / noise_variance
        b.reshape(-1)[:: len(b) + 1] += 1
        factor, info = scipy.linalg.lapack.dpotrf(b.T, lower=True, overwrite_a=True)
        return None if info else cls(basis, relative_noise, noise_variance, factor, gradient)

    @cached_property
    def log_determinant(self) -> float:
        scale = np.log(self.noise_variance) * len(self.relative_noise)
        return float(scale + 2 * np.log(self.relative_noise).sum() + 2 * np.log(self.factor.diagonal()).sum())

    def solve(self, right: Array) -> Array:
        q = self.basis.q
        rows = right.T / self.relative_noise
        along = rows @ q
        beside = rows - along @ q.T
        # Project twice: rounding leaves a component along Q, which the factor would have made small.
        beside -= beside @ q @ q.T
        kept, _ = scipy.linalg.lapack.dpotrs(self.factor, along.T, lower=True)
        solution = beside + kept.reshape(along.T.shape).T @ q.T
        return np.asarray((solution / self.relative_noise).T / self.noise_variance)

    def gradient_times(self, c: Array) -> Array:
        at_points = self.gradient.times(self.weights_at_centres(c)) @ self.basis.r.T
        return np.asarray(at_points @ self.basis.q.T * self.relative_noise)

    def centres(self, times: Array) -> Array:
        return np.asarray(times[0] + self.basis.points)

    def weights_at_centres(self, c: Array) -> Array:
        """Return Wᵀ c, shape (…, m): Σ_i c_i κ(t − t_i) = Σ_j (Wᵀ c)_j κ(t − x_j) where the points x_j resolve κ."""
        return self.basis.weights(self.relative_noise * c)

    def likelihood_traces(self, c: Array) -> tuple[Array, float]:
        n, m = self.basis.q.shape
        root, _ = scipy.linalg.lapack.dtrtrs(self.factor, self.basis.r, lower=True)
        u = self.weights_at_centres(c)
        by_kernel = self.gradient.traces(m, packed(root.T @ root / self.noise_variance)) - self.gradient.times(u) @ u
        # ϱ σ_n² A⁻¹ ϱ is the identity on the complement of span Q, and B⁻¹ on span Q: tr(A⁻¹ V) = n − m + tr(B⁻¹).
        inverse, _ = scipy.linalg.lapack.dtrtri(self.factor, lower=True)
        by_noise = n - m + np.sum(inverse**2) - self.noise_variance * np.sum((self.relative_noise * c) ** 2)
        return by_kernel, float(by_noise)
