"""Smooth kernels: K = W C Wᵀ, where C is the covariance of m Chebyshev points and m may be much smaller than n.

This holds up to rounding if the Chebyshev coefficients of the covariance fall below rounding. W interpolates from the
points to the n sample times and does not depend on the hyperparameters. W is orthogonalised once; then every matrix
that depends on the hyperparameters has size m.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple, Self

import numpy as np
import scipy

from trackably.arrays import Array
from trackably.gp.factors.factorisation import Woodbury
from trackably.gp.stencil import Covariance

# Polynomial interpolation in Chebyshev points, and how many points resolve a covariance.
#
# L. N. Trefethen, Approximation Theory and Approximation Practice, chapters 2, 3 and 5.

ROUNDING = 4 * float(np.finfo(float).eps)  # part of the largest covariance: smaller differences are not resolved
_CHECKED = 7 / 8  # coefficients above rounding level must all be among this first part of the coefficients
_CACHE_SIZE = 4  # bases that are kept
_ON_NODE = 1e-200  # part of the interval: a time this close to a node counts as the node, or a division would overflow


def nodes(first: float, last: float, count: int) -> Array:
    """Return the extrema of the Chebyshev polynomial of degree count − 1 on [first, last], increasing: (count,)."""
    return (first + last) / 2 - (last - first) / 2 * np.cos(np.pi * np.arange(count) / (count - 1))


def coefficients(values: Array) -> Array:
    """Return the Chebyshev coefficients of the interpolants of values at `nodes`; shape (…, count), as the values."""
    scaled = scipy.fft.dct(values[..., ::-1], type=1) / (values.shape[-1] - 1)
    scaled[..., [0, -1]] /= 2
    return np.asarray(scaled)


def interpolation(t: Array, first: float, last: float, count: int) -> Array:
    """Return the matrix (n, count) that maps values at `nodes` to the interpolant at t, shape (n,) in [first, last].

    Uses the barycentric formula, which is stable. Absolute values in a row sum to at most 1 + (2/π) ln(count) + 0.3.
    """
    weights = np.where(np.arange(count) % 2, -1.0, 1.0)
    weights[[0, -1]] /= 2
    distances = t[:, None] - nodes(first, last, count)
    hits = np.abs(distances) < _ON_NODE * (last - first)
    distances[hits] = 1.0
    matrix = weights / distances
    hit = np.any(hits, axis=1)
    matrix[hit] = hits[hit]
    return np.asarray(matrix / matrix.sum(axis=1, keepdims=True))


class Basis(NamedTuple):
    """An interpolation matrix W = ϱ Q R: the `points` [s] (m,), Q (n, m) orthonormal, R (m, m) upper triangular.

    W maps values at the points to values at the samples; ϱ is the diagonal matrix of relative noise.
    """

    points: Array
    q: Array
    r: Array


@dataclass(frozen=True)
class Bases:
    """Interpolation bases of samples at `times` in [0, span] [s] with `relative_noise`, computed on demand.

    A basis depends on the sample times and the number of points only, not on the hyperparameters.
    """

    times: Array
    relative_noise: Array
    span: float

    @cached_property
    def of(self) -> Callable[[int], Basis]:
        """Return the basis of a number of points; the last few are kept, as an optimiser alternates between them."""
        return lru_cache(_CACHE_SIZE)(self._compute)

    def points_for(self, covariance: Covariance, most: int) -> int | None:
        """Return the number of points that resolve a covariance and its derivatives up to ROUNDING.

        Return None if `most` points are too few.

        A covariance of t and t' consists of waves e^(iω(t − t')), which are interpolated in t with the same accuracy
        for every t'. So two times t' suffice to see every ω.
        """
        points = nodes(0.0, self.span, most)
        value, gradient = covariance(points - np.array([[0.0], [self.span / 2]]))
        rows = np.concatenate([value[None], gradient])
        sizes = np.abs(coefficients(rows)) > ROUNDING * np.max(np.abs(rows), axis=(1, 2), keepdims=True)
        degree = max(np.flatnonzero(sizes.any(axis=(0, 1))).tolist(), default=most)
        # Frequencies too high for `most` points appear as (alias onto) the last coefficients. So the covariance counts
        # as resolved only if these last coefficients are at rounding level.
        count = _round_up(degree + 2)
        return count if count <= most and degree < _CHECKED * most else None

    def _compute(self, count: int) -> Basis:
        matrix = interpolation(self.times, 0.0, self.span, count)
        q, r = np.linalg.qr(matrix / self.relative_noise[:, None])
        return Basis(nodes(0.0, self.span, count), q, r)


def _round_up(count: int) -> int:
    """Round up to 2ᵏ or 3 · 2ᵏ⁻¹ for a whole number k, so that one basis serves many iterates of an optimiser."""
    step = 1 << max(0, count.bit_length() - 2)
    return -(-count // step) * step


@dataclass(frozen=True)
class LowRank(Woodbury):
    """A = ϱ (σ_n² I + Q R C Rᵀ Qᵀ) ϱ: C is the covariance of m points, ϱ Q R the `basis` that interpolates from these.

    Sample i has noise ϱ_i σ_n. `factor` is the Cholesky factor L of B = I + R C Rᵀ/σ_n² = L Lᵀ, a matrix of size m;
    `gradient` is ∂C/∂ln θ_j, shape (p, m, m).
    """

    basis: Basis
    gradient: Array

    @classmethod
    def of(cls, relative_noise: Array, noise_variance: float, basis: Basis, covariance: Covariance) -> Self | None:
        """Factorise A = ϱ (σ_n² I + Q R C Rᵀ Qᵀ) ϱ, the covariance of samples with noise, for σ_n² = `noise_variance`.

        ϱ is the `relative_noise`, ϱ Q R the interpolation of the `basis`, and C the `covariance` of its points. None if
        I + R C Rᵀ/σ_n² is not positive definite in float64.
        """
        between, gradient = covariance(basis.points[:, None] - basis.points)
        b = np.eye(len(between)) + basis.r @ between @ basis.r.T / noise_variance
        factor, info = scipy.linalg.lapack.dpotrf(b.T, lower=True, overwrite_a=True)
        return None if info else cls(relative_noise, noise_variance, factor, basis, gradient)

    def solve(self, right: Array) -> Array:
        q = self.basis.q
        rows = right.T / self.relative_noise
        along = rows @ q
        beside = rows - along @ q.T
        # Project again: rounding has left in `beside` a component in span Q. The solution would contain it unchanged,
        # though in span Q it has to be multiplied by B⁻¹.
        beside -= beside @ q @ q.T
        solution = beside + self._solve(along) @ q.T
        return np.asarray((solution / self.relative_noise).T / self.noise_variance)

    def gradient_times(self, c: Array) -> Array:
        at_points = self.gradient @ self.weights_at_centres(c) @ self.basis.r.T
        return np.asarray(at_points @ self.basis.q.T * self.relative_noise)

    def centres(self, times: Array) -> Array:
        return np.asarray(times[0] + self.basis.points)

    def weights_at_centres(self, c: Array) -> Array:
        """Return Wᵀ c (…, m), where W interpolates from the points x_j to the samples.

        As the points resolve κ, Σ_i c_i κ(t − t_i) = Σ_j (Wᵀ c)_j κ(t − x_j).
        """
        return np.asarray(self.relative_noise * c @ self.basis.q @ self.basis.r)

    def likelihood_traces(self, c: Array) -> tuple[Array, float]:
        n, m = self.basis.q.shape
        root, _ = scipy.linalg.lapack.dtrtrs(self.factor, self.basis.r, lower=True)
        u = self.weights_at_centres(c)
        by_kernel = np.tensordot(self.gradient, root.T @ root / self.noise_variance - np.outer(u, u), 2)
        # With noise V = σ_n² ϱ², σ_n² ϱ A⁻¹ ϱ is the identity on the complement of span Q, and Q B⁻¹ Qᵀ on span Q:
        # tr(A⁻¹ V) = n − m + tr(B⁻¹).
        inverse, _ = scipy.linalg.lapack.dtrtri(self.factor, lower=True)
        by_noise = n - m + np.sum(inverse**2) - self.noise_variance * np.sum((self.relative_noise * c) ** 2)
        return np.asarray(by_kernel), float(by_noise)
