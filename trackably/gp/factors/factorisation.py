"""The interface of a factorised covariance matrix: factor once, then solve often."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from functools import lru_cache

import numpy as np
import numpy.typing as npt
import scipy

from trackably.arrays import Array

# Symmetric matrices with each entry stored once, in LAPACK's rectangular full packed format.
#
# The triangle of the last columns lies mirrored above that of the first ones, and both fill a rectangle. For n = 6 it
# has the entries (row, column)
#
#     33 43 53
#     00 44 54
#     10 11 55
#     20 21 22
#     30 31 32
#     40 41 42
#     50 51 52
#
# and for odd n it lacks the first row, as the left half has one column more. Kernels are evaluated for n (n + 1)/2
# pairs of samples instead of n². LAPACK works on blocks of half the size, which is faster than its unblocked code for
# small n.
#
# F. G. Gustavson, J. Waśniewski, J. J. Dongarra, J. Langou, Rectangular full packed format for Cholesky's algorithm,
# ACM Transactions on Mathematical Software 37 (2010).

Places = npt.NDArray[np.intp]

_FEW = 50  # rows: with no more, gathering all entries of several matrices is faster than calling LAPACK for each

LOWER = "L"
"""The triangle that is stored, as LAPACK calls it."""


def places(n: int) -> tuple[Places, Places]:
    """Return row and column of each stored entry of an (n, n) matrix, row ≥ column; the shapes are (n (n + 1)/2,)."""
    left, above = (n + 1) // 2, 1 - n % 2
    column, row = np.arange(left)[:, None], np.arange(-above, n)  # LAPACK stores column after column
    is_left = row >= column
    rows, columns = np.where(is_left, row, column + n - left), np.where(is_left, column, row + above + left)
    return rows.ravel(), columns.ravel()


@lru_cache(maxsize=64)
def diagonal(n: int) -> Places:
    """Return the storage indices of the diagonal, from its first entry to its last; the shape is (n,)."""
    rows, columns = places(n)
    stored = np.flatnonzero(rows == columns)
    return stored[np.argsort(rows[stored])]


@lru_cache(maxsize=64)
def _storage_index(n: int) -> Places:
    """Return the storage index of each entry of a symmetric (n, n) matrix, above the diagonal too; shape (n, n)."""
    rows, columns = places(n)
    found = np.empty((n, n), dtype=np.intp)
    found[rows, columns] = found[columns, rows] = np.arange(rows.size)
    return found


def differences(times: Array) -> Array:
    """Return t_i − t_j [s] of n `times` for each stored entry (i, j); the shape is (n (n + 1)/2,)."""
    rows, columns = places(len(times))
    return np.asarray(times[rows] - times[columns])


def pack(matrix: Array) -> Array:
    """Return the stored entries of a symmetric matrix (n, n); the shape is (n (n + 1)/2,)."""
    return np.asarray(scipy.linalg.lapack.dtrttf(matrix.T, uplo=LOWER)[0])


def products(matrices: Array, c: Array) -> Array:
    """Return D_j c, shape (p, n), for the stored entries (p, n (n + 1)/2) of symmetric `matrices` D_j, and c (n,)."""
    if len(c) <= _FEW:
        return np.asarray(matrices.take(_storage_index(len(c)), axis=1) @ c)
    found = np.zeros((len(matrices), len(c)))
    for product, entries in zip(found, matrices, strict=True):
        lower, _ = scipy.linalg.lapack.dtfttr(len(c), entries, uplo=LOWER)  # undefined above the diagonal
        scipy.linalg.blas.dsymv(1.0, lower, c, y=product, overwrite_y=True, lower=True)
    return found


Covariance = Callable[[Array], tuple[Array, Array]]
"""Returns k(r) of two samples r [s] apart, and ∂k/∂ln θ_j; shapes (*r.shape) and (p, *r.shape). k is even in r."""


def weighted_sum(covariance: Covariance, parts: Iterable[tuple[Array | float, Array]]) -> tuple[Array, Array]:
    """Return Σ ρ k(r) and its ∂/∂ln θ_j for the `covariance` k: a sum over pairs of weights ρ and times r [s]."""
    total, by_theta = np.zeros(()), np.zeros(())
    for rho, r in parts:
        value, gradient = covariance(r)
        total, by_theta = total + rho * value, by_theta + rho * gradient
    return total, by_theta


Entries = Callable[[slice], tuple[Array, Array]]
"""Returns some of the stored entries of K (see `pack`), and of ∂K/∂ln θ_j; shapes (N,) and (p, N)."""


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


# Covariance matrices of samples with their derivatives, each entry once, computed in parts that stay in the cache.

_PART = 2**13  # entries that are computed at once


def gram(n: int, entries: Entries) -> tuple[Array, Array]:
    """Return the stored entries of the covariance matrix K of n samples, and of ∂K/∂ln θ_j; shapes (N,) and (p, N).

    All large arrays share one block of memory. Several blocks would go back to the operating system when freed, and
    getting them again, page by page, takes longer than computing their content.
    """
    count = n * (n + 1) // 2
    first, gradient = entries(slice(_PART))
    if count <= _PART:
        return first, gradient
    memory = np.empty((1 + len(gradient), count))
    memory[0, :_PART], memory[1:, :_PART] = first, gradient
    for start in range(_PART, count, _PART):
        part = slice(start, start + _PART)
        memory[0, part], memory[1:, part] = entries(part)
    return memory[0], memory[1:]
