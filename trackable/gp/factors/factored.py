"""What a posterior asks of its covariance matrix: factored once, then asked often."""

from abc import ABC, abstractmethod
from collections.abc import Callable

from trackable.arrays import Array

Covariance = Callable[[Array], tuple[Array, Array]]
"""k(r) of two samples that lie r [s] apart, and ∂k/∂ln θ_j: shapes (*r.shape) and (p, *r.shape). Even in r."""


class Factored(ABC):
    """A = K + V: the covariance K of n samples, with its derivatives in p hyperparameters, and diagonal noise V."""

    @property
    @abstractmethod
    def log_determinant(self) -> float:
        """ln|A|."""

    @abstractmethod
    def solve(self, right: Array) -> Array:
        """A⁻¹ r for one r of shape (n,), or for the columns of an (n, m)."""

    @abstractmethod
    def gradient_times(self, c: Array) -> Array:
        """∂K/∂ln θ_j c for c of shape (n,): shape (p, n)."""

    def instants(self, times: Array) -> Array:
        """Where kernels stand in the posterior mean: at the samples, `times` [s], unless fewer do."""
        return times

    def gathered(self, c: Array) -> Array:
        """What weights c of the samples, shape (…, n), become at those instants."""
        return c

    @abstractmethod
    def contracted(self, c: Array) -> tuple[Array, float]:
        """tr((A⁻¹ − c cᵀ) ∂K/∂ln θ_j), shape (p,), and tr((A⁻¹ − c cᵀ) V), for c of shape (n,)."""
