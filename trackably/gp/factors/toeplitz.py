"""Regularly spaced samples: the covariance matrix is a Toeplitz matrix, factorised in O(n²) time and O(n) memory.

Durbin's recursion: G. H. Golub and C. F. Van Loan, Matrix Computations (4th edition), section 4.7.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, Self

import numpy as np
import scipy

from trackably.arrays import Array
from trackably.gp.factors.factorisation import Covariance, Factorisation
from trackably.gp.factors.grid import Grid

_RESIDUAL = 1e-5  # of the recursion, before refinement: if it is larger, the determinant is not accurate
_NEGLIGIBLE = 1e-17  # as a reflection: adding it to f₀ = 1 changes nothing


class Inverse(NamedTuple):
    """A⁻¹ e₁, shape (n,), which determines A⁻¹, and ln|A|."""

    first_column: Array
    log_determinant: float


def durbin(column: Array) -> Inverse | None:
    """Run Durbin's recursion on the first `column` of A, shape (n,); None if A is not positive definite in float64.

    With A_k the leading k × k block and A_k f = E_k e₁, f₀ = 1, one more row updates

        f ← (f, 0) + ρ (0, reversed f),   ρ = −Σ_j f_j a_{k−j} / E_k,   E_{k+1} = E_k (1 − ρ²),

    and |A| is the product of all E_k. A is positive definite if every reflection ρ lies inside (−1, 1). Samples that
    lie far apart are almost independent: f ends (at `last`) where all later reflections are negligible.
    """
    n, scale, blas = len(column), float(column[0]), scipy.linalg.blas
    if not scale > 0:
        return None
    reversed_column = column[::-1] / scale
    f, before, errors = np.zeros(n), np.zeros(n), [1.0]
    f[0], last = 1.0, 0
    for k in range(1, n):
        reflection = -blas.ddot(f, reversed_column, last + 1, 0, 1, n - 1 - k) / errors[-1]
        if not abs(reflection) < 1:
            return None
        if abs(reflection) > _NEGLIGIBLE:
            blas.dcopy(f, before, last + 1)
            blas.daxpy(before, f, last + 1, reflection, 0, -1, k - last)
            last = k
        errors.append(errors[-1] * (1 - reflection) * (1 + reflection))
    return Inverse(f / (scale * errors[-1]), float(n * np.log(scale) + np.sum(np.log(errors))))


@dataclass(frozen=True)
class Toeplitz(Factorisation):
    """A = K + σ_n² I, stored as its first `column` (n,) and its `inverse`; `gradient` (p, n): first columns of ∂K.

    A⁻¹ = (L(x) L(x)ᵀ − L(z) L(z)ᵀ)/x₀ with the lower triangular Toeplitz matrices L of x = A⁻¹ e₁ and of
    z = (0, x_{n−1}, …, x₁) (Gohberg and Semencul): a product with A⁻¹ takes a few fast Fourier transforms.
    """

    column: Array
    inverse: Inverse
    gradient: Array
    noise_variance: float

    @classmethod
    def of(cls, grid: Grid, covariance: Covariance, noise_variance: float) -> Self | None:
        """Factorise for samples on a `grid`; None if the recursion breaks down, or loses too many digits to refine."""
        column, gradient = covariance(grid.lags)
        column = column.copy()
        column[0] += noise_variance
        if (inverse := durbin(column)) is None:
            return None
        rough = cls(column, inverse, gradient, noise_variance)
        unit = np.eye(1, grid.count)[0]
        left = unit - rough._times(column, inverse.first_column)
        if np.linalg.norm(left) > _RESIDUAL * noise_variance * np.linalg.norm(inverse.first_column):
            return None
        refined = inverse.first_column + rough._inverse_times(left)
        return replace(rough, inverse=inverse._replace(first_column=refined))

    @property
    def log_determinant(self) -> float:
        return self.inverse.log_determinant

    def solve(self, right: Array) -> Array:
        rows = right.T
        rough = self._inverse_times(rows)
        return np.asarray((rough + self._inverse_times(rows - self._times(self.column, rough))).T)

    def gradient_times(self, c: Array) -> Array:
        return self._times(self.gradient, c)

    def likelihood_traces(self, c: Array) -> tuple[Array, float]:
        sums = self._diagonal_sums
        twice = 2 * sums
        twice[0] /= 2
        trace = self.gradient @ twice - self.gradient_times(c) @ c
        return trace, float(self.noise_variance * (sums[0] - c @ c))

    @property
    def _diagonal_sums(self) -> Array:
        """Diagonal sums of A⁻¹: Σ_i (A⁻¹)_{i, i+k} = Σ_m (n − k − 2m) x_m x_{m+k}/x₀ for k = 0 … n − 1."""
        x, m = self.inverse.first_column, np.arange(len(self.column))
        spectrum = self._spectra[0]
        by_lag, by_place = (self._signal(np.conj(self._spectrum(f)) * spectrum) for f in (x, m * x))
        return np.asarray(((len(x) - m) * by_lag - 2 * by_place) / x[0])

    def _inverse_times(self, rows: Array) -> Array:
        """Return A⁻¹ r for each r of an array (…, n)."""
        spectrum = self._spectrum(rows)
        plus, minus = (f * self._spectrum(self._signal(np.conj(f) * spectrum)) for f in self._spectra)
        return np.asarray(self._signal(plus - minus) / self.inverse.first_column[0])

    def _times(self, column: Array, rows: Array) -> Array:
        """Return T r for symmetric Toeplitz matrices T with first columns (…, n), and rows r (…, n)."""
        circle = np.zeros((*column.shape[:-1], self._length))
        circle[..., : column.shape[-1]] = column
        circle[..., -column.shape[-1] + 1 :] = column[..., :0:-1]
        return self._signal(self._spectrum(circle) * self._spectrum(rows))

    @cached_property
    def _spectra(self) -> tuple[Array, Array]:
        x = self.inverse.first_column
        return self._spectrum(x), self._spectrum(np.append(0.0, x[:0:-1]))

    @cached_property
    def _length(self) -> int:
        """The length of the transforms: long enough that circular products do not wrap around."""
        return int(scipy.fft.next_fast_len(2 * len(self.column), real=True))

    def _spectrum(self, rows: Array) -> Array:
        return np.asarray(scipy.fft.rfft(rows, self._length))

    def _signal(self, spectrum: Array) -> Array:
        return np.asarray(scipy.fft.irfft(spectrum, self._length)[..., : len(self.column)])
