"""Smooth kernels that decay, and periodic ones: K = Φ diag(s) Φᵀ with m cosines and sines in the columns of Φ.

Let T be the span of the samples. If κ is at rounding level from a distance P − T on, it equals its periodic summation
Σ_j κ(r + j P) at all distances |r| ≤ T up to rounding, and a cosine transform of κ has its coefficients:

    κ(r) = Σ_k s_k cos(ω_k r),    ω_k = 2πk/P.

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
from trackably.gp.factors.factorisation import Factorisation, cholesky_solve
from trackably.gp.kernels.base import Kernel
from trackably.gp.stencil import Covariance, Stencil, Stencils

_STEPS = 4  # rungs of the ladder of periods, while the reach (period minus span of the samples) doubles
_LOWEST = -13  # index of the lowest rung: its period is about 10 % longer than the span, and serves all shorter reaches
_LONGEST = 2.0**100  # times the span: the longest reach of a kernel for which waves are used
_VANISHED = 36.0  # e^(−x) is at rounding level for every larger x
_EPS = float(np.finfo(float).eps)
_LOST = 16 * _EPS  # relative to the largest coefficient: smaller ones are rounding errors
_OFF_GRID = np.arange(1, 5) * (math.sqrt(5) - 1) / 4 % 1  # parts of a distance at which a sum of cosines is checked


class Cosines(NamedTuple):
    """κ(r) = Σ_k s_k cos(2πk r/P) for a period P [s], with `powers` s_k (K,) and `gradient` ∂s_k/∂ln θ_j (p, K)."""

    powers: Array
    gradient: Array

    @property
    def waves(self) -> int:
        """The number m = 2K − 1 of cosines and sines of these frequencies, of which the first one is zero."""
        return 2 * len(self.powers) - 1


def cosines(covariance: Covariance, period: float, reach: float, span: float, most: float) -> Cosines | None:
    """Return the cosines of a `period` P [s] whose sum is an even covariance κ up to rounding, at distances to `span`.

    None is returned if this takes more than `most` waves, or if κ is zero in float64. κ is evaluated up to its `reach`:
    P/2 if κ has the period (the span is P), or else a distance of at most P − span, beyond which κ is lost in rounding.
    The sum is then Σ_j κ(r + j P), of which only κ(r) is left within the span.

    Frequencies too high for the transform would appear as (alias onto) lower ones: these take more waves, or their sum
    is wrong between the points of the transform. So the sum is checked there, where κ is not lost, and beyond P/2 if κ
    should have the period; None is returned if it is wrong.
    """
    half = int(most)  # points in half a period: twice as many frequencies
    last = math.ceil(2 * half * (reach / period))
    checked = min(span, 2 * reach) * _OFF_GRID
    value, gradient = covariance(np.concatenate([checked, period / (2 * half) * np.arange(last + 1)]))
    between, variance = value[: len(checked)], value[len(checked)]
    rows = np.concatenate([value[None], gradient])[:, len(checked) :]
    rows[:, ::last] /= 2  # both ends, by the trapezoidal rule
    found = np.fft.rfft(rows, 2 * half).real * (2 / half)
    found[:, 0] /= 2
    sizes = np.abs(found[0])
    kept = found[:, : np.flatnonzero(sizes >= _LOST * sizes.max())[-1] + 1]  # all, if all are zero
    lines = Cosines(kept[0], kept[1:])
    if lines.waves > most:
        return None
    phases = np.multiply.outer(np.arange(len(lines.powers)), math.tau / period * checked)
    wrong = np.abs(lines.powers @ np.cos(phases) - between).max()
    return lines if wrong <= _LOST * len(lines.powers) * variance else None


def waves_at(times: Array, period: float, count: int) -> Array:
    """Return the `count` waves 1, cos ω₁t, sin ω₁t, cos ω₂t, … of a `period` [s] at `times` t [s], (count, n).

    Whole periods are subtracted from times exactly, so that phases after many periods lose no digits.
    """
    angles = (np.arange(1, count // 2 + 1) * (math.tau / period))[:, None] * np.fmod(times, period)
    phi = np.ones((count, len(times)))
    phi[1::2], phi[2::2] = np.cos(angles), np.sin(angles)
    return phi


class Waves(NamedTuple):
    """m cosines and sines at n samples: `scaled` ϱ⁻¹ Φ (n, m), and its `products` Φᵀ ϱ⁻² Φ (m, m).

    The columns of Φ are 1, cos ω₁t, sin ω₁t, cos ω₂t, … with ω_k = 2πk/P and t from the middle of the samples, as a
    stencil measures them. The noise of sample i has the standard deviation ϱ_i σ_n; ϱ is diagonal. `moved` is
    ϱ⁻¹ ∂Φ/∂ln P (n, m) if P is the last hyperparameter of the kernel.
    """

    scaled: Array
    products: Array
    moved: Array | None = None


@dataclass(frozen=True)
class Ladder:
    """Waves at `times` [s], as a `stencil` measures them, with `relative_noise` ϱ.

    Periods of kernels that decay come from a fixed ladder, so that the same waves serve many hyperparameters. On each
    rung, the period P is the span of the samples plus a reach, a distance beyond which κ is lost in rounding. Reaches
    form a geometric series.
    """

    times: Array
    relative_noise: Array
    stencil: Stencil | Stencils
    _last: dict[tuple[float, int], Waves] = field(default_factory=dict, init=False, repr=False)
    """The waves of the last rung, which an optimiser's next iterates mostly need."""

    @cached_property
    def span(self) -> float:
        return float(self.times[-1] - self.times[0]) + self.stencil.length

    def waves(self, kernel: Kernel, most: float) -> tuple[Waves, Cosines] | None:
        """Return the waves of the shortest period that suffices for a kernel, with their coefficients.

        Return None if the kernel has no such sum, or if this takes more than `most` waves.
        """
        if period := kernel.hyperparameters.get("period"):
            lines = cosines(kernel.value_and_gradient, period, period / 2, period, most)
            return lines and (self._compute(period, lines.waves, has_moved=True), lines)
        reach = kernel.extent(_VANISHED)
        if not (kernel.is_analytic and reach < _LONGEST * self.span):
            return None
        place = max(math.ceil(_STEPS * math.log2(reach / self.span)), _LOWEST)
        period = self.span * (1 + math.exp2(place / _STEPS))
        found = cosines(kernel.value_and_gradient, period, reach, self.span, most)
        if found is None:
            return None
        # Compute a few waves more, for other kernels. Their number must not depend on earlier calls; else the last bits
        # of results would depend on earlier calls.
        count = found.waves
        rung = period, math.floor(math.exp2(math.ceil(_STEPS * math.log2(count)) / _STEPS)) | 1
        if rung not in self._last:
            self._last.clear()
            self._last[rung] = self._compute(*rung)
        waves = self._last[rung]
        return Waves(waves.scaled[:, :count], waves.products[:count, :count]), found

    def _compute(self, period: float, count: int, has_moved: bool = False) -> Waves:
        times = self.stencil.centres(self.times - (self.times[0] + self.times[-1]) / 2)
        phi, moved = waves_at(times, period, count), None
        if has_moved:
            psi = np.zeros_like(phi)
            psi[1::2], psi[2::2] = phi[2::2], -phi[1::2]
            frequencies = (np.arange(count) + 1) // 2 * (math.tau / period)
            moved = (self.stencil.combine(times * psi) / self.relative_noise).T * frequencies
        phi = self.stencil.combine(phi) / self.relative_noise
        return Waves(phi.T, phi @ phi.T, moved)


@dataclass(frozen=True)
class Fourier(Factorisation):
    """A = σ_n² ϱ (I + M Mᵀ) ϱ, by the Cholesky `factor` L of B = I + Mᵀ M = L Lᵀ.

    M = ϱ⁻¹ Φ diag(`root`) (n, m) has the `waves` Φ; s_k are the coefficients of κ. Sample i has noise of the standard
    deviation ϱ_i σ_n: `relative_noise` ϱ (n,) and `noise_variance` σ_n². `root` is √s_k/σ_n (m,), and `slope` is
    ∂ln s_k/∂ln θ_j (p, m).
    """

    relative_noise: Array
    noise_variance: float
    factor: Array
    waves: Waves
    root: Array
    slope: Array

    @classmethod
    def of(cls, relative_noise: Array, noise_variance: float, waves: Waves, terms: Cosines) -> Self | None:
        """Factorise A for σ_n² = `noise_variance`; None if B = I + Mᵀ M is not positive definite in float64."""
        powers = np.maximum(terms.powers, _EPS * terms.powers.max())  # rounding errors may be negative
        gradient = terms.gradient / powers
        if waves.moved is not None:
            gradient[-1] = 0  # the coefficients do not depend on the period
        # of a cosine and a sine of each frequency, but the first one, which is zero
        root, slope = (each.repeat(2, axis=-1)[..., 1:] for each in (np.sqrt(powers / noise_variance), gradient))
        b = waves.products * root
        b *= root[:, None]
        b.reshape(-1)[:: len(b) + 1] += 1
        factor, info = scipy.linalg.lapack.dpotrf(b.T, lower=True, overwrite_a=True)
        return None if info else cls(relative_noise, noise_variance, factor, waves, root, slope)

    @property
    def log_determinant(self) -> float:
        of_noise = len(self.relative_noise) * math.log(self.noise_variance) + 2 * np.log(self.relative_noise).sum()
        return float(of_noise + 2 * np.log(self.factor.diagonal()).sum())

    def solve(self, right: Array) -> Array:
        y = right.T / self.relative_noise
        x = cholesky_solve(self.factor, self._along(y).T).T
        rest = y - self._spread(x)
        # Refine: rest = (I + M Mᵀ)⁻¹ y up to rounding, so Mᵀ rest should be x = B⁻¹ Mᵀ y, B = I + Mᵀ M. Remove the
        # effect of the difference.
        rest -= self._spread(cholesky_solve(self.factor, (self._along(rest) - x).T).T)
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
