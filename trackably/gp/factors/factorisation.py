"""The interface of a factorised covariance matrix: factor once, then solve often."""

from abc import ABC, abstractmethod
from collections.abc import Callable

from trackably.arrays import Array

Covariance = Callable[[Array], tuple[Array, Array]]
"""k(r) of two samples r [s] apart, and ∂k/∂ln θ_j: shapes (*r.shape) and (p, *r.shape). Even in r."""

Entries = Callable[[slice], tuple[Array, Array]]
"""Some of the stored entries of K (see `factors.packed`), and of ∂K/∂ln θ_j: shapes (N,) and (p, N)."""


class Factorisation(ABC):
    """A = K + V, factorised: the covariance K of n samples, with p hyperparameters, and diagonal noise V."""

    @property
    @abstractmethod
    def log_determinant(self) -> float:
        """ln|A|."""

    @abstractmethod
    def solve(self, right: Array) -> Array:
        """Return A⁻¹ r for one r of shape (n,), or for the columns of an (n, m)."""

    @abstractmethod
    def gradient_times(self, c: Array) -> Array:
        """Return (∂K/∂ln θ_j) c for c of shape (n,): shape (p, n)."""

    @abstractmethod
    def likelihood_traces(self, c: Array) -> tuple[Array, float]:
        """Return tr((A⁻¹ − c cᵀ) ∂K/∂ln θ_j), shape (p,), and tr((A⁻¹ − c cᵀ) V), for c of shape (n,).

        With c = A⁻¹ (y − m) these are the gradient of the negative log marginal likelihood.
        """

    def centres(self, times: Array) -> Array:
        """Return the centres [s] of the kernels in the posterior mean: the sample `times` [s], or fewer points."""
        return times

    def weights_at_centres(self, c: Array) -> Array:
        """Convert weights c of the samples, shape (…, n), to weights at `centres`."""
        return c
