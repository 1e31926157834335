"""Regularly spaced samples: the covariance is a Toeplitz matrix, and so nothing needs more memory than the samples."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from scipy import fft

from trackable.arrays import Array
from trackable.gp.factors.durbin import Inverse, durbin
from trackable.gp.factors.factored import Covariance, Factored
from trackable.gp.factors.grid import Grid

_RESIDUAL = 1e-5  # of the recursion, before refinement: more, and its determinant is not to be trusted


@dataclass(frozen=True)
class Toeplitz(Factored):
    """A = K + σ_n² I by its first `column` (n,) and its `inverse`; `gradient` (p, n) has the first columns of ∂K.

    A⁻¹ = (L(x) L(x)ᵀ − L(z) L(z)ᵀ)/x₀ with the lower triangular Toeplitz matrices L of x = A⁻¹ e₁ and of
    z = (0, x_{n−1}, …, x₁) (Gohberg and Semencul): every product with it is a handful of fast Fourier transforms.
    """

    column: Array
    inverse: Inverse
    gradient: Array
    noise_variance: float

    @classmethod
    def of(cls, grid: Grid, covariance: Covariance, noise_variance: float) -> Self | None:
        """From samples on a grid; None where the recursion breaks down, or loses too many digits to be refined."""
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

    def contracted(self, c: Array) -> tuple[Array, float]:
        sums = self._diagonal_sums
        twice = 2 * sums
        twice[0] /= 2
        trace = self.gradient @ twice - self.gradient_times(c) @ c
        return trace, float(self.noise_variance * (sums[0] - c @ c))

    @property
    def _diagonal_sums(self) -> Array:
        """Σ_i (A⁻¹)_{i, i+k} = Σ_m (n − k − 2m) x_m x_{m+k}/x₀ for k = 0 … n − 1."""
        x, m = self.inverse.first_column, np.arange(len(self.column))
        spectrum = self._spectra[0]
        by_lag, by_place = (self._signal(np.conj(self._spectrum(f)) * spectrum) for f in (x, m * x))
        return np.asarray(((len(x) - m) * by_lag - 2 * by_place) / x[0])

    def _inverse_times(self, rows: Array) -> Array:
        """A⁻¹ r for each r of an array (…, n)."""
        spectrum = self._spectrum(rows)
        plus, minus = (f * self._spectrum(self._signal(np.conj(f) * spectrum)) for f in self._spectra)
        return np.asarray(self._signal(plus - minus) / self.inverse.first_column[0])

    def _times(self, column: Array, rows: Array) -> Array:
        """T r for symmetric Toeplitz matrices T with first columns (…, n), and rows r (…, n)."""
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
        """Of the transforms: room enough for what a product shifts out at either end."""
        return int(fft.next_fast_len(2 * len(self.column), real=True))

    def _spectrum(self, rows: Array) -> Array:
        return np.asarray(fft.rfft(rows, self._length))

    def _signal(self, spectrum: Array) -> Array:
        return np.asarray(fft.irfft(spectrum, self._length)[..., : len(self.column)])
