"""The interface of a factorised covariance matrix: factor once, then solve often."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable

import numpy as np

from trackably.arrays import Array

Covariance = Callable[[Array], tuple[Array, Array]]
"""Returns k(r) of two samples r [s] apart, and ∂k/∂ln θ_j; shapes (*r.shape) and (p, *r.shape). k is even in r."""


def weighted_sum(covariance: Covariance, parts: Iterable[tuple[Array | float, Array]]) -> tuple[Array, Array]:
    """Return Σ ρ k(r) and its ∂/∂ln θ_j for the `covariance` k: a sum over pairs of weights ρ and times r [s]."""
    total, by_theta = np.zeros(()), np.zeros(())
    for rho, r in parts:
        value, gradient = covariance(r)
        total, by_theta = total + rho * value, by_theta + rho * gradient
    return total, by_theta


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
