"""The learned signal: a constant plus a sum of kernels, as plain stored numbers."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Self

import numpy as np

from trackably.arrays import Array
from trackably.gp.factors.factorisation import in_blocks
from trackably.gp.hyperparameter import Learned
from trackably.gp.kernels.base import Kernel, sum_by_moments

_ROUNDING = 2  # spacings of float64: centres that differ by no more count as equal
_LONG = 200  # centres
_FEW = 2**16  # terms: a sum with no more is summed directly
_MANY = 2**22  # terms: for fewer, direct summation is faster than looking for a regular grid
_MANY_OF_MOMENTS = 2**18  # terms: for fewer, moments of all centres take longer than the sum
_NEARBY = 2**14  # terms that are summed at once, so that their times are neighbours


@dataclass(frozen=True)
class KernelSum:
    """m⁺(t) = m + Σ_i c_i κ(t − t_i) with `mean` m, `centres` t_i [s] and `weights` c_i (shape (n,) both).

    This is all that a reference is made of: how the weights were found does not matter to any later claim about it. Nor
    does it matter which hyperparameters were learned: all are plain numbers here. The arrays are copies and read-only,
    so that no reference changes after it is proved.
    """

    kernel: Kernel
    mean: float
    centres: Array
    weights: Array

    def __post_init__(self) -> None:
        if any(isinstance(value, Learned) for value in self.kernel.hyperparameters.values()):
            object.__setattr__(self, "kernel", self.kernel.as_known())
        for name, given in (("centres", self.centres), ("weights", self.weights)):
            array = np.array(given, dtype=float)
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    @classmethod
    def of_terms(cls, kernel: Kernel, mean: float, centres: Array, weights: Array) -> Self:
        """Return m + Σ_i c_i κ(t − t_i); terms whose centres agree up to rounding are merged.

        Such terms occur if samples have regular times, and each depends on the process at several times.
        """
        order = np.argsort(centres, kind="stable")
        in_order = centres[order]
        is_new = np.diff(in_order) > _ROUNDING * np.spacing(np.abs(in_order[1:]))
        first = np.append(0, np.flatnonzero(is_new) + 1)[: len(centres)]
        return cls(kernel, mean, in_order[first], np.add.reduceat(weights[order], first))

    def jet(self, t: Array, order: int) -> Array:
        """Return m⁺ and its time derivatives up to `order` at t [s]: shape (order + 1, *t.shape).

        If the kernel is a sum of polynomials times e^(−λ|r|), it is evaluated from moments when that is faster.
        """
        t = np.asarray(t, dtype=float)
        if t.size * len(self.centres) * (order + 1) <= _FEW and len(self.centres) < _LONG:
            jet = np.asarray(self.kernel.jet(t[..., None] - self.centres, order) @ self.weights)
        else:
            jet = self._sums(t, order)
        jet[0] += self.mean
        return jet

    def __call__(self, t: Array) -> Array:
        return np.asarray(self.jet(t, 0)[0])

    def nearly(self, t: Array) -> Array:
        """Return m⁺(t) with a few rounding errors more, if that is faster: for searches, not for proofs."""
        if t.size * len(self.centres) > _FEW or len(self.centres) >= _LONG:
            return np.asarray(self.jet(t, 0)[0])
        return np.asarray(self.kernel.value(t[..., None] - self.centres) @ self.weights + self.mean)

    def summed(self, t: Array) -> Array:
        """Return m⁺ at t [s] as plain sums of products. Certificates bound the rounding errors of this evaluation."""
        return np.asarray(self._blocks(np.asarray(t, dtype=float), 0)[0] + self.mean)

    def derivative(self, t: Array) -> Array:
        return np.asarray(self.jet(t, 1)[1])

    def _sums(self, t: Array, order: int) -> Array:
        if len(self.centres) >= _LONG and t.size * len(self.centres) > _MANY_OF_MOMENTS and self.kernel.decays:
            return sum_by_moments(self.kernel.decays, self.centres, self.weights, t, order)
        terms = t.shape[-1] * self._most_relevant if t.ndim else 0
        if terms > _MANY and t.ndim > 1:
            return np.stack([self._sums(row, order) for row in t], axis=1)
        if self._most_relevant > len(self.centres) // 2:
            return self._blocks(t, order)
        return in_blocks(partial(self._nearby, order), t, self._most_relevant * (order + 1), _NEARBY)[0]

    def _blocks(self, t: Array, order: int) -> Array:
        products = partial(self._products, order, self.kernel.vanishing_distance)
        return in_blocks(products, t, len(self.centres) * (order + 1))[0]

    def _nearby(self, order: int, t: Array) -> tuple[Array]:
        return self._products(order, self.kernel.negligible_distance, t)

    def _products(self, order: int, reach: float, t: Array) -> tuple[Array]:
        centres, weights = self._relevant(t, reach)
        return (self.kernel.jet(t[..., None] - centres, order) @ weights,)

    def _relevant(self, t: Array, reach: float) -> tuple[Array, Array]:
        """Return the centres within reach [s] of any of the times, and their weights."""
        if not (len(self.centres) >= _LONG and np.isfinite(reach) and t.size):
            return self.centres, self.weights
        centres, weights = self._in_order
        first, last = np.searchsorted(centres, [np.min(t) - reach, np.max(t) + reach]).tolist()
        return centres[first:last], weights[first:last]

    @cached_property
    def _most_relevant(self) -> int:
        """The largest number of centres whose kernels are not negligible at one time."""
        reach = self.kernel.negligible_distance
        if not (len(self.centres) >= _LONG and np.isfinite(reach)):
            return len(self.centres)
        centres, _ = self._in_order
        last = np.searchsorted(centres, centres + 2 * reach, side="right")
        return int(np.max(last - np.arange(len(last))))

    @cached_property
    def _in_order(self) -> tuple[Array, Array]:
        """Centres in increasing order, and their weights."""
        order = np.argsort(self.centres, kind="stable")
        return self.centres[order], self.weights[order]


# Signals that remember their values, as several quantities are evaluated at the same times.

_LONG_ROW = 32  # shorter rows of times are those of single minima, which no other quantity has


@dataclass(frozen=True)
class CachedSum(KernelSum):
    """A sum of kernels that evaluates each long row of times only once, by `nearly`, and caches it for ever."""

    known: dict[bytes, Array] = field(default_factory=dict)

    @classmethod
    def of(cls, signal: KernelSum) -> Self:
        return cls(signal.kernel, signal.mean, signal.centres, signal.weights)

    def __call__(self, t: Array) -> Array:
        if np.ndim(t) != 2 or t.shape[-1] < _LONG_ROW:
            return self.nearly(t)
        keys = [row.tobytes() for row in t]
        new = [j for j, key in enumerate(keys) if key not in self.known]
        if new:
            self.known.update(zip((keys[j] for j in new), self.nearly(t[new]), strict=True))
        return np.stack([self.known[key] for key in keys])


@dataclass(frozen=True)
class EvaluationCache:
    """The `signals` of a posterior or function, with cached values."""

    signals: tuple[CachedSum, ...]

    @classmethod
    def of(cls, signals: Sequence[KernelSum]) -> Self:
        return cls(tuple(map(CachedSum.of, signals)))
