"""Regularly spaced samples: the covariance matrix is a Toeplitz matrix, factorised in O(n²) time and O(n) memory.

Durbin's recursion: G. H. Golub and C. F. Van Loan, Matrix Computations (4th edition), section 4.7.
"""

from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import NamedTuple, Self

import numpy as np
import scipy

from trackably.arrays import Array
from trackably.gp.factors.factorisation import Covariance, Factorisation
from trackably.gp.kernels.base import Kernel

# Regularly spaced times, up to rounding.

_REGULAR = 1e-6  # of a step: a larger deviation is not regular


@dataclass(frozen=True)
class Grid:
    """The times start + i step [s] for i = 0 … count − 1, which approximate given times up to `deviation` [s]."""

    start: float
    step: float
    count: int
    deviation: float

    @classmethod
    def of(cls, times: Array) -> Self | None:
        """Return the grid from the first of `times` (n,) to the last; None if they do not lie on it or n < 3."""
        if times.ndim != 1 or len(times) < 3 or not times[-1] > times[0]:
            return None
        start, count = float(times[0]), len(times)
        step = (float(times[-1]) - start) / (count - 1)
        deviation = float(np.max(np.abs(times - (start + step * np.arange(count)))))
        return cls(start, step, count, deviation) if deviation <= _REGULAR * step else None

    @property
    def lags(self) -> Array:
        """The lags i step [s], shape (count,)."""
        return self.step * np.arange(self.count, dtype=float)

    @property
    def span(self) -> float:
        """The duration from the first time to the last [s]."""
        return self.step * (self.count - 1)

    @property
    def rounding(self) -> float:
        """The largest deviation [s] that rounding alone can cause, of a time and of its grid point together."""
        return 2 * float(np.spacing(max(abs(self.start), abs(self.start + self.span))))

    @property
    def is_exact(self) -> bool:
        """Whether the times deviate from the grid by rounding only."""
        return self.deviation <= self.rounding


# Sums of kernels with regular centres at regular times: one convolution, if the two spacings are commensurate.

_FINEST = 100  # the largest denominator of the ratio of spacings
_COST = 60  # terms of the sum that take as long as one point of the transforms


def convolved(kernel: Kernel, centres: Array, weights: Array, t: Array, order: int) -> Array | None:
    """Return Σ_i c_i κ⁽ⁿ⁾(t − t_i) for n = 0 … order at increasing times t [s]: shape (order + 1, *t.shape).

    None unless times and centres lie on grids, up to rounding, whose steps are p h and q h with whole numbers p and q,
    and the convolution takes less time than the sum. On a common grid of step h, with zeros between the weights, the
    lag from centre i to time j is that from the first centre to the first time, plus (j p − i q) h.
    """
    if (of := Grid.of(centres)) is None or (at := Grid.of(t)) is None or not (of.is_exact and at.is_exact):
        return None
    ratio = Fraction(at.step / of.step).limit_denominator(_FINEST)
    p, q = ratio.numerator, ratio.denominator
    if p == 0 or abs(at.step * q - of.step * p) * at.count > q * (at.rounding + of.rounding):
        return None
    first, last = -(of.count - 1) * q, (at.count - 1) * p
    length = int(scipy.fft.next_fast_len(last - first + 1, real=True))
    if _COST * length > at.count * of.count:
        return None
    lags = at.start - of.start + of.step / q * np.arange(first, last + 1, dtype=float)
    spread = np.zeros(last - first + 1)
    spread[: -first + 1 : q] = weights
    # Lags begin at `first`, so that entry j p − first of the convolution is the sum for time j. Circular wrap-around
    # corrupts only entries before these.
    spectrum = scipy.fft.rfft(kernel.jet(lags, order), length) * scipy.fft.rfft(spread, length)
    return np.asarray(scipy.fft.irfft(spectrum, length)[:, -first : last - first + 1 : p])


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
