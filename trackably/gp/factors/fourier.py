"""Kernels with a spectral density S that decays fast: K = Φ diag(s) Φᵀ with m cosines and sines in the columns of Φ.

Let T be the span of the samples. If κ is at rounding level from a distance P − T on, it equals its periodic summation
Σ_j κ(r + j P) at all distances |r| ≤ T up to rounding, and Poisson's summation formula has its Fourier coefficients:

    κ(r) = Σ_k s_k cos(ω_k r),    ω_k = 2πk/P,    s_0 = S(0)/P,    s_k = 2 S(ω_k)/P.

Φ depends on the hyperparameters through P only. Sample i has noise of standard deviation ϱ_i σ_n; below, ϱ is the
diagonal matrix of these ϱ_i, and ∂ a derivative by ln θ_j. With M = ϱ⁻¹ Φ diag(√s)/σ_n and B = I + Mᵀ M, of size m,

    A = K + V = σ_n² ϱ (I + M Mᵀ) ϱ,    |I + M Mᵀ| = |B|,    (I + M Mᵀ)⁻¹ = I − M B⁻¹ Mᵀ,

    tr(A⁻¹ ∂K) = Σ_k ∂ln s_k (1 − (B⁻¹)_kk),    cᵀ ∂K c = Σ_k ∂ln s_k s_k (Φᵀ c)_k².

So a gradient takes the diagonal of B⁻¹, and the exponentials of m frequencies instead of n (n + 1)/2 pairs of samples.

A periodic kernel is such a sum at all distances, with its own period P, a hyperparameter. By ln P, Φ has the derivative
Ψ. With N = ϱ⁻¹ Ψ diag(√s)/σ_n, the traces are then tr(A⁻¹ ∂K) = 2 tr(B⁻¹ Mᵀ N) and cᵀ ∂K c = 2 σ_n² (Mᵀ ϱ c)·(Nᵀ ϱ c).
"""

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple, Self

import numpy as np
import scipy

from trackably.arrays import Array
from trackably.gp.factors.factorisation import Woodbury
from trackably.gp.kernels.base import SpectralDensity
from trackably.gp.stencil import Stencil

_STEPS = 4  # rungs of the ladder of periods, while the reach (period minus span of the samples) doubles
_LOWEST = -13  # index of the lowest rung: its period is about 10 % longer than the span, and serves all shorter reaches
_LONGEST = 2.0**100  # times the span: the longest reach of a kernel for which waves are used
_CACHED = 2**23  # numbers in the cache of waves, as an optimiser's iterates alternate between a few periods


class Waves(NamedTuple):
    """Columns of Φ (n, m): 1, cos ω₁t, sin ω₁t, cos ω₂t, … with ω_k = 2πk/P and t from the middle of the samples.

    `period` is P [s], `scaled` is ϱ⁻¹ Φ (n, m), and `products` are Φᵀ ϱ⁻² Φ (m, m). The noise of sample i has the
    standard deviation ϱ_i σ_n; ϱ is diagonal. `moved` is ϱ⁻¹ ∂Φ/∂ln P (n, m) if P is the last hyperparameter of the
    kernel.
    """

    period: float
    scaled: Array
    products: Array
    moved: Array | None = None

    def first(self, count: int) -> "Waves":
        """Return the first `count` of these waves, the columns of Φ with the lowest frequencies."""
        return Waves(self.period, self.scaled[:, :count], self.products[:count, :count])

    @property
    def frequencies(self) -> Array:
        """The frequency ω [rad/s] of each column of Φ, shape (m,): 0, ω₁, ω₁, ω₂, ω₂, …"""
        return np.asarray((np.arange(len(self.products)) + 1) // 2 * (math.tau / self.period))


def waves_at(times: Array, period: float, count: int) -> Array:
    """Return the `count` waves 1, cos ω₁t, sin ω₁t, cos ω₂t, … of a `period` [s] at `times` t [s], (count, n)."""
    angles = (np.arange(1, count // 2 + 1) * (math.tau / period))[:, None] * times
    phi = np.ones((count, len(times)))
    phi[1::2], phi[2::2] = np.cos(angles), np.sin(angles)
    return phi


def harmonic_count(density: SpectralDensity, period: float) -> int:
    """Return the number m = 1 + 2k of waves of a `period` [s], up to the k-th harmonic.

    The `density` is negligible at higher frequencies.
    """
    return 1 + 2 * round(density.limit * period / math.tau)


@dataclass(frozen=True)
class Ladder:
    """Waves at `times` [s] with `relative_noise` ϱ.

    Their periods come from a fixed series, so that the same waves serve many spectral densities. A period P is the span
    of the times plus a reach, a distance beyond which κ is below rounding errors. Reaches form a geometric series.
    """

    times: Array
    relative_noise: Array
    _cache: dict[tuple[int, int], Waves] = field(default_factory=dict, init=False, repr=False)

    @cached_property
    def span(self) -> float:
        return float(self.times[-1] - self.times[0])

    def waves(self, density: SpectralDensity, most: float) -> Waves | None:
        """Return the waves of the shortest period that suffices for a density, from the cache if they are there.

        Return None if this period is too long, or takes more than `most` waves.
        """
        waves_at_least = density.limit * (self.span + density.reach) / math.pi
        if not (waves_at_least < most and density.reach < _LONGEST * self.span):
            return None
        place = max(math.ceil(_STEPS * math.log2(density.reach / self.span)), _LOWEST)
        period = self.span * (1 + math.exp2(place / _STEPS))
        count = 1 + 2 * math.floor(density.limit * period / math.tau)
        if count > most:
            return None
        # Compute a few waves more, for other densities. Their number must not depend on earlier calls; else the
        # last bits of results would depend on earlier calls.
        key = place, math.floor(math.exp2(math.ceil(_STEPS * math.log2(count)) / _STEPS)) | 1
        found = self._cache.pop(key, None)
        if found is None:
            found = self._compute(period, key[1])
            while self._cache and found.scaled.size + sum(each.scaled.size for each in self._cache.values()) > _CACHED:
                del self._cache[next(iter(self._cache))]
        self._cache[key] = found  # a dictionary keeps its order: the last entry is the one used last
        return found.first(count)

    def harmonics(self, density: SpectralDensity, period: float, stencil: Stencil, most: float) -> Waves | None:
        """Return the harmonics of a `period` [s], as the `stencil` measures them; None if they are more than `most`.

        Whole periods are subtracted from times exactly, so that phases of samples after many periods lose no digits.
        """
        if (count := harmonic_count(density, period)) > most:
            return None
        times = stencil.centres(self.times - self._middle)
        phi = waves_at(np.fmod(times, period), period, count)
        psi = np.zeros_like(phi)
        psi[1::2], psi[2::2] = phi[2::2], -phi[1::2]
        phi, psi = (stencil.combine(rows) / self.relative_noise for rows in (phi, times * psi))
        found = Waves(period, phi.T, phi @ phi.T)
        return found._replace(moved=psi.T * found.frequencies)

    @property
    def _middle(self) -> float:
        """The middle of the times, about which they have the smallest rounding errors."""
        return float(self.times[0]) + self.span / 2

    def _compute(self, period: float, count: int) -> Waves:
        phi = waves_at(self.times - self._middle, period, count)
        phi /= self.relative_noise
        return Waves(period, phi.T, phi @ phi.T)


@dataclass(frozen=True)
class Fourier(Woodbury):
    """A = σ_n² ϱ (I + M Mᵀ) ϱ, by the Cholesky `factor` L of B = I + Mᵀ M = L Lᵀ.

    M = ϱ⁻¹ Φ diag(`root`) (n, m) has the `waves` Φ; s_k are the Fourier coefficients of κ, and ϱ is relative noise.
    `root` is √s_k/σ_n (m,), and `slope` is ∂ln s_k/∂ln θ_j (p, m).
    """

    waves: Waves
    root: Array
    slope: Array

    @classmethod
    def of(cls, relative_noise: Array, noise_variance: float, waves: Waves, density: SpectralDensity) -> Self | None:
        """Factorise A = σ_n² ϱ (I + M Mᵀ) ϱ, the covariance of samples with noise, for σ_n² = `noise_variance`.

        ϱ is the `relative_noise`; M follows from the `waves` and the kernel's spectral `density`. None if I + Mᵀ M is
        not positive definite in float64.
        """
        power, slope = density.at(waves.frequencies)
        power *= 2 / (waves.period * noise_variance)
        power[0] *= 0.5
        root = np.sqrt(power, out=power)
        b = waves.products * root
        b *= root[:, None]
        b.reshape(-1)[:: len(b) + 1] += 1
        factor, info = scipy.linalg.lapack.dpotrf(b.T, lower=True, overwrite_a=True)
        return None if info else cls(relative_noise, noise_variance, factor, waves, root, slope)

    def solve(self, right: Array) -> Array:
        y = right.T / self.relative_noise
        x = self._solve(self._along(y))
        rest = y - self._spread(x)
        # Refine: rest = (I + M Mᵀ)⁻¹ y up to rounding, so Mᵀ rest should be x = B⁻¹ Mᵀ y, B = I + Mᵀ M. Remove the
        # effect of the difference.
        rest -= self._spread(self._solve(self._along(rest) - x))
        return np.asarray((rest / self.relative_noise).T / self.noise_variance)

    def gradient_times(self, c: Array) -> Array:
        noise = self.relative_noise
        along = self._along(noise * c)
        found = self._spread(self.slope * along)
        if self._moved is not None:
            found[-1] += self._spread((noise * c) @ self._moved) + self._moved @ along
        return np.asarray(found * noise * self.noise_variance)

    def likelihood_traces(self, c: Array) -> tuple[Array, float]:
        inverse, _ = scipy.linalg.lapack.dpotri(self.factor, lower=True)
        lost, scaled = inverse.diagonal(), self.relative_noise * c
        along = self._along(scaled)
        by_kernel = self.slope.dot(1 - lost - self.noise_variance * along**2)
        if self._moved is not None:
            products = self._along(self._moved.T)
            products += products.T  # the inverse has no entries above its diagonal
            traced = 2 * np.sum(inverse * products) - lost.dot(products.diagonal())
            by_kernel[-1] += traced - 2 * self.noise_variance * along.dot(scaled @ self._moved)
        # With noise V, A = V^½ (I + M Mᵀ) V^½ (n, n) and B = I + Mᵀ M (m, m): tr(A⁻¹ V) = n − m + tr(B⁻¹). The diagonal
        # of B⁻¹ is `lost`.
        by_noise = len(c) - len(lost) + np.add.reduce(lost) - self.noise_variance * scaled.dot(scaled)
        return by_kernel, float(by_noise)

    @cached_property
    def _moved(self) -> Array | None:
        """N = ϱ⁻¹ ∂Φ/∂ln P diag(`root`) (n, m), the derivative of M by the logarithm of the period; None if it is 0."""
        return None if self.waves.moved is None else self.waves.moved * self.root

    def _along(self, rows: Array) -> Array:
        """Return Mᵀ times each of the `rows` (…, n), with M = ϱ⁻¹ Φ diag(`root`); the shape is (…, m)."""
        return np.asarray(rows @ self.waves.scaled * self.root)

    def _spread(self, rows: Array) -> Array:
        """Return M times each of the `rows` (…, m), with M = ϱ⁻¹ Φ diag(`root`); the shape is (…, n)."""
        return np.asarray((rows * self.root) @ self.waves.scaled.T)
