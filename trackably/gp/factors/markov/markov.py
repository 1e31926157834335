"""Matérn kernels at any times: products of band matrices.

With the differences D of samples (see `differences`),

    A = K + V = D⁻¹ B D⁻ᵀ,        B = D K Dᵀ + D V Dᵀ,        A⁻¹ = Dᵀ B⁻¹ D,        |A| = |B|.

B is a band matrix: solutions, determinant and gradient take linear time and memory. (H. Chen, L. Ding and R. Tuo:
Kernel packet: an exact and scalable algorithm for Gaussian process regression with Matérn correlations, J. Mach. Learn.
Res. 23 (2022), take differences on both sides of a sample, of twice as many times.) B is well-conditioned unless
samples are dense beside 1/λ. Derivatives are imaginary parts: all of it is computed for ln λ + i ε.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
import scipy

from trackably.arrays import Array
from trackably.gp.factors.cached import cached
from trackably.gp.factors.factorisation import Factorisation
from trackably.gp.factors.markov.banded import condition, congruent, log_determinant_slope, plus, times_vector
from trackably.gp.factors.markov.differences import Differenced, Lags, cancelled, differenced, order, width
from trackably.gp.kernels.moments import Decay

_EPS = float(np.finfo(float).eps)
_STEP = 1e-30  # ε: its square is lost in rounding
_WIDEST = 20  # diagonals: samples that see more of the process than that are left to other factorisations
_AT_ONCE = 2**15  # numbers of right sides that stay in the cache


@dataclass(frozen=True)
class Markov(Factorisation):
    """A for noise variances (n,): the samples `stepped` to differences for ln λ + i ε, and the Cholesky `factor` of B.

    The kernel has the hyperparameters θ₁, whose square it is proportional to, and θ₂ ∝ 1/λ.
    """

    noise_variance: Array
    stepped: Differenced
    factor: Array

    @classmethod
    def of(cls, times: Array, decay: Decay, lags: Lags, noise_variance: Array, largest_error: float) -> Self | None:
        """Factorise for n increasing `times` [s]; None if B is not positive definite in float64.

        None, too, where rounding may change solutions by more than the `largest_error`, relative: times that are dense
        beside 1/λ, or some that are close to each other beside others that are not.
        """
        if width(times, order(decay), lags) > _WIDEST or not _EPS * cancelled(times, decay, lags) <= largest_error:
            return None
        stepped = differenced(times, decay, lags, 1 + 1j * _STEP)
        b = plus(stepped.covariance.real, congruent(stepped.differences.real, noise_variance))
        factor, info = scipy.linalg.lapack.dpbtrf(b, lower=True)
        if info or not _EPS * condition(b, factor) <= largest_error:
            return None
        return cls(noise_variance, stepped, factor)

    @cached
    def log_determinant(self) -> float:
        return 2 * float(np.sum(np.log(self.factor[0])))

    def solve(self, right: Array) -> Array:
        rows = np.atleast_2d(right.T)
        found, height = np.empty(rows.shape), max(1, _AT_ONCE // rows.shape[1])
        for first in range(0, len(rows), height):
            found[first : first + height] = self._solved(rows[first : first + height])
        return np.asarray(found.reshape(right.T.shape).T)

    def gradient_times(self, c: Array) -> Array:
        """Return 2 K c and ∂K/∂ln θ₂ c, shape (2, n), with K = D⁻¹ (D K Dᵀ) D⁻ᵀ."""
        d, covariance = self.stepped
        behind, _ = scipy.linalg.lapack.ztbtrs(d, c[:, None].astype(complex), uplo="L", trans="T")
        product = times_vector(covariance, behind[:, 0])
        found, _ = scipy.linalg.lapack.ztbtrs(d, product[:, None], uplo="L")
        return np.array([2 * found[:, 0].real, -found[:, 0].imag / _STEP])

    def likelihood_traces(self, c: Array) -> tuple[Array, float]:
        """tr(A⁻¹ ∂A) is ∂ ln|B|; and tr(A⁻¹ K) = n − tr(A⁻¹ V)."""
        d, covariance = self.stepped
        b = plus(covariance, congruent(d, self.noise_variance))
        by_noise = log_determinant_slope(
            plus(b.real, 1j * _STEP * congruent(self._differences, self.noise_variance)), _STEP
        )
        by_kernel = np.array([2 * (len(c) - by_noise), -log_determinant_slope(b, _STEP)])
        return by_kernel - self.gradient_times(c) @ c, float(by_noise - self.noise_variance @ c**2)

    def _solved(self, rows: Array) -> Array:
        """Return Dᵀ B⁻¹ D r for each r of the rows (m, n)."""
        d = self._differences
        along = rows.copy()
        for lag, weights in enumerate(d[1:], 1):
            along[:, lag:] += weights[:-lag] * rows[:, :-lag]
        kept, _ = scipy.linalg.lapack.dpbtrs(self.factor, along.T, lower=True)
        found: Array = kept.T.copy()
        for lag, weights in enumerate(d[1:], 1):
            found[:, :-lag] += weights[:-lag] * kept.T[:, lag:]
        return found

    @cached
    def _differences(self) -> Array:
        return np.ascontiguousarray(self.stepped.differences.real)
