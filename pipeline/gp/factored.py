"""What a posterior asks of its covariance matrix: factored once, then asked often."""

from abc import ABC, abstractmethod
from collections.abc import Callable

from pipeline.arrays import Array

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

    @abstractmethod
    def contracted(self, c: Array) -> tuple[Array, Array]:
        """tr((A⁻¹ − c cᵀ) ∂K/∂ln θ_j), shape (p,), and the diagonal of A⁻¹ − c cᵀ, shape (n,)."""
