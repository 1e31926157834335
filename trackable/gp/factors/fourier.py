"""Kernels with a spectral density S that decays fast: K = Φ diag(s) Φᵀ with m cosines and sines in the columns of Φ.

Let T be the span of the samples. If κ is at rounding level from a distance P − T on, it equals its periodic summation
Σ_j κ(r + j P) at all distances |r| ≤ T up to rounding, and Poisson's summation formula has its Fourier coefficients:

    κ(r) = Σ_k s_k cos(ω_k r),    ω_k = 2πk/P,    s_0 = S(0)/P,    s_k = 2 S(ω_k)/P.

Φ depends on the hyperparameters through P only. With M = ϱ⁻¹ Φ diag(√s)/σ_n and B = I + Mᵀ M, of size m,

    A = K + V = σ_n² ϱ (I + M Mᵀ) ϱ,    |I + M Mᵀ| = |B|,    (I + M Mᵀ)⁻¹ = I − M B⁻¹ Mᵀ,

    tr(A⁻¹ ∂K) = Σ_k ∂ln s_k (1 − (B⁻¹)_kk),    cᵀ ∂K c = Σ_k ∂ln s_k s_k (Φᵀ c)_k².

So a gradient takes the diagonal of B⁻¹, and the exponentials of m frequencies instead of n (n + 1)/2 pairs of samples.
"""

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple, Self

import numpy as np
import scipy

from trackable.arrays import Array
from trackable.gp.factors.factorisation import Factorisation
from trackable.gp.kernels.spectral import SpectralDensity

_STEPS = 4  # periods on the ladder while the reach doubles
_LOWEST = -13  # its first place: a period about 10 % longer than the span, which serves all short reaches
_LONGEST = 2.0**100  # spans: no reach that matters is longer, and float64 has the ladder up to there
_CACHE_SIZE = 16  # periods: an optimiser's iterates alternate between a few


class Waves(NamedTuple):
    """1, cos ω₁t, sin ω₁t, cos ω₂t, …: columns of Φ (n, m) with `frequencies` ω [rad/s] (m,) and a `period` P [s].

    `features` are ϱ⁻² Φ (n, m), and `products` Φᵀ ϱ⁻² Φ (m, m).
    """

    period: float
    frequencies: Array
    features: Array
    products: Array

    def first(self, count: int) -> "Waves":
        """Return the first of these waves."""
        return Waves(self.period, self.frequencies[:count], self.features[:, :count], self.products[:count, :count])


class Rung(NamedTuple):
    """One of the ladder's periods, and how many waves a density needs."""

    place: int
    waves: int


@dataclass(frozen=True)
class Ladder:
    """Waves at `times` [s] with `relative_variance` ϱ², for periods on a ladder, so that they serve many densities."""

    times: Array
    relative_variance: Array
    _cache: dict[int, Waves] = field(default_factory=dict, init=False, repr=False)

    @cached_property
    def span(self) -> float:
        return float(self.times[-1] - self.times[0])

    @cached_property
    def log_variance(self) -> float:
        """Σ_i ln ϱ_i²."""
        return float(np.sum(np.log(self.relative_variance)))

    @cached_property
    def least_variance(self) -> float:
        return float(np.min(self.relative_variance))

    def rung(self, density: SpectralDensity, most: float) -> Rung | None:
        """Return the shortest period for a density, and its number of waves; None if these are more than `most`."""
        waves_at_least = density.limit * (self.span + density.reach) / math.pi
        if not (waves_at_least < most and density.reach < _LONGEST * self.span):
            return None
        place = max(math.ceil(_STEPS * math.log2(density.reach / self.span)), _LOWEST)
        count = 1 + 2 * math.ceil(density.limit * self._period(place) / math.tau)
        return Rung(place, count) if count <= most else None

    def waves(self, rung: Rung) -> Waves:
        """Return the waves of a rung, from the cache of the most recently used ones if they are there."""
        found = self._cache.pop(rung.place, None)
        if found is None or len(found.frequencies) < rung.waves:
            found = self._computed(self._period(rung.place), int(2 ** (1 / _STEPS) * rung.waves) | 1)
        self._cache[rung.place] = found  # a dictionary keeps its order: the last entry is the one used last
        if len(self._cache) > _CACHE_SIZE:
            del self._cache[next(iter(self._cache))]
        return found.first(rung.waves)

    def _period(self, place: int) -> float:
        return self.span * (1 + math.exp2(place / _STEPS))

    def _computed(self, period: float, count: int) -> Waves:
        frequencies = (np.arange(count) + 1) // 2 * (math.tau / period)
        middle = self.times[0] + self.span / 2  # the shorter the times, the less of an angle is rounded
        angles = frequencies[::2, None] * (self.times - middle)
        phi = np.empty((count, len(self.times)))
        phi[0::2], phi[1::2] = np.sin(angles), np.cos(angles[1:])
        phi[0] = 1.0
        features = np.asarray((phi / self.relative_variance).T)
        return Waves(period, np.asarray(frequencies), features, phi @ features)


@dataclass(frozen=True)
class Fourier(Factorisation):
    """A as above, by the `factor` L of B = L Lᵀ, with `root` √s_k/σ_n (m,) and `slope` ∂ln s_k/∂ln θ_j (p, m)."""

    ladder: Ladder
    waves: Waves
    noise_variance: float
    root: Array
    slope: Array
    factor: Array

    @classmethod
    def of(
        cls, ladder: Ladder, rung: Rung, density: SpectralDensity, noise_variance: float, largest: float
    ) -> Self | None:
        """Factorise for σ_n² = `noise_variance`; None if κ(0) > `largest` σ_n², or B is not positive definite."""
        waves = ladder.waves(rung)
        power, slope = density.at(waves.frequencies)
        power *= 2 / (waves.period * noise_variance)
        power[0] *= 0.5
        if not np.add.reduce(power[::2]) <= largest:
            return None
        root = np.sqrt(power, out=power)
        b = waves.products * root
        b *= root[:, None]
        b.reshape(-1)[:: len(b) + 1] += 1
        factor, info = scipy.linalg.lapack.dpotrf(b.T, lower=True, overwrite_a=True)
        return None if info else cls(ladder, waves, noise_variance, root, slope, factor)

    @property
    def log_determinant(self) -> float:
        noise = len(self.ladder.times) * math.log(self.noise_variance) + self.ladder.log_variance
        return noise + 2 * float(np.add.reduce(np.log(self.factor.diagonal())))

    def solve(self, right: Array) -> Array:
        variance, features = self.ladder.relative_variance, self.waves.features
        x = self._solved(right.T @ features * self.root)
        rest = right.T / variance - x * self.root @ features.T
        # Mᵀ (I + M Mᵀ)⁻¹ = B⁻¹ Mᵀ: what is left along M should be x. Correct it for what rounding left there.
        beside = self._solved((variance * rest) @ features * self.root - x)
        return np.asarray((rest - beside * self.root @ features.T).T / self.noise_variance)

    def _solved(self, rows: Array) -> Array:
        """Return B⁻¹ times each of the rows, shape (…, m)."""
        solved, _ = scipy.linalg.lapack.dpotrs(self.factor, rows.T, lower=True, overwrite_b=True)
        return np.asarray(solved.reshape(rows.T.shape).T)

    def gradient_times(self, c: Array) -> Array:
        variance = self.ladder.relative_variance
        along = self.slope * (self.noise_variance * self.root**2 * (variance * c @ self.waves.features))
        return np.asarray(along @ self.waves.features.T * variance)

    def likelihood_traces(self, c: Array) -> tuple[Array, float]:
        inverse, _ = scipy.linalg.lapack.dtrtri(self.factor, lower=True)
        inverse *= inverse
        lost = np.add.reduce(inverse, axis=0)  # the diagonal of B⁻¹
        scaled = self.ladder.relative_variance * c
        along = scaled @ self.waves.features * self.root
        by_kernel = self.slope.dot(1 - lost - self.noise_variance * along**2)
        by_noise = len(c) - len(lost) + np.add.reduce(lost) - self.noise_variance * scaled.dot(c)
        return by_kernel, float(by_noise)
