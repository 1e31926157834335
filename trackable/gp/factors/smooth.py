"""Smooth kernels: samples by the thousand say no more than the signal's values at a few well-placed times.

A stationary covariance whose Chebyshev coefficients fall below rounding has K = W C Wᵀ, up to rounding: W interpolates
from m Chebyshev points to the n sample times, whatever the hyperparameters, and C is the covariance of the points. With
W orthogonalised once, everything that depends on hyperparameters is of size m.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from scipy.linalg import lapack

from trackable.arrays import Array
from trackable.gp.factors.bases import Basis
from trackable.gp.factors.factored import Covariance, Factored
from trackable.gp.factors.gram import Strips, gram


@dataclass(frozen=True)
class Smooth(Factored):
    """A = ϱ (σ_n² I + Q R C Rᵀ Qᵀ) ϱ with noise ϱ_i σ_n of sample i: through B = I + R C Rᵀ/σ_n² = L Lᵀ of size m."""

    basis: Basis
    relative_noise: Array
    noise_variance: float
    factor: Array
    gradient: Strips

    @classmethod
    def of(cls, basis: Basis, covariance: Covariance, relative_noise: Array, noise_variance: float) -> Self | None:
        """With σ_n² as `noise_variance`; None where B is not positive definite in float64."""
        upper, _, gradient = gram(basis.points, covariance)
        between = np.triu(upper) + np.triu(upper, 1).T
        b = basis.r @ between @ basis.r.T / noise_variance
        b.reshape(-1)[:: len(b) + 1] += 1
        factor, info = lapack.dpotrf(b.T, lower=True, overwrite_a=True)
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
        # Once more, for rounding leaves a part along Q behind, that the factor would have made small.
        beside -= beside @ q @ q.T
        kept, _ = lapack.dpotrs(self.factor, along.T, lower=True)
        solution = beside + kept.reshape(along.T.shape).T @ q.T
        return np.asarray((solution / self.relative_noise).T / self.noise_variance)

    def gradient_times(self, c: Array) -> Array:
        at_points = self.gradient.times(self.gathered(c)) @ self.basis.r.T
        return np.asarray(at_points @ self.basis.q.T * self.relative_noise)

    def instants(self, times: Array) -> Array:
        return np.asarray(times[0] + self.basis.points)

    def gathered(self, c: Array) -> Array:
        """Wᵀ c, shape (…, m): Σ_i c_i κ(t − t_i) is Σ_j (Wᵀ c)_j κ(t − x_j), as far as points resolve the kernel."""
        return np.asarray((self.relative_noise * c) @ self.basis.q @ self.basis.r)

    def contracted(self, c: Array) -> tuple[Array, float]:
        n, m = self.basis.q.shape
        root, _ = lapack.dtrtrs(self.factor, self.basis.r, lower=True)
        u = self.gathered(c)
        by_kernel = self.gradient.contracted(root.T @ root / self.noise_variance) - self.gradient.times(u) @ u
        # With P = Q Qᵀ, σ_n² A⁻¹ is that of 1 beside P, and that of B along it: tr(A⁻¹ V) = n − m + tr(B⁻¹).
        inverse, _ = lapack.dtrtri(self.factor, lower=True)
        by_noise = n - m + np.sum(inverse**2) - self.noise_variance * np.sum((self.relative_noise * c) ** 2)
        return by_kernel, float(by_noise)
