"""The learned signal: a constant plus a sum of kernels, as plain stored numbers."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Self

import numpy as np

from trackably.arrays import Array
from trackably.gp.kernels.base import Kernel, MomentSum
from trackably.work import done

_ROUNDING = 2  # spacings of float64: centres that differ by no more than this count as equal
_LONG = 200  # centres: for fewer, the plain sum over all of them is fastest
_MANY_OF_MOMENTS = 2**18  # terms (times × centres): for fewer, moments of all centres take longer than the sum


# Evaluate functions of many times block by block, in bounded memory.

_WHOLE = 2**16  # numbers (times × width): up to this many, one call is faster than several
_BLOCK = 2**15  # numbers in a block, which stay in the cache: larger arrays are fetched from memory for each operation


def in_blocks(function: Callable[[Array], Array], t: Array, width: int) -> Array:
    """Evaluate a function of times t (any shape) that returns an array (…, *t.shape), block by block.

    The function must treat each time separately; it needs memory for `width` numbers for each time. It is called only
    once if it needs so few in all that one call is fastest.
    """
    if t.size * width <= _WHOLE:
        return function(t)
    flat, height = t.reshape(-1), max(1, _BLOCK // width)
    blocks = list[Array]()
    for i in range(0, flat.size, height):
        blocks.append(function(flat[i : i + height]))
        done("part")
    joined = np.concatenate(blocks, axis=-1)
    return joined.reshape((*joined.shape[:-1], *t.shape))


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
        if self.kernel.learned:
            object.__setattr__(self, "kernel", self.kernel.as_known())
        for name, given in (("centres", self.centres), ("weights", self.weights)):
            array = np.array(given, dtype=float)
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    @classmethod
    def of_terms(cls, kernel: Kernel, mean: float, centres: Array, weights: Array) -> Self:
        """Return m + Σ_i c_i κ(t − t_i); terms whose centres agree up to rounding are merged.

        Such terms occur if samples have regular times, and each sample depends on the process at several times.
        """
        order = np.argsort(centres, kind="stable")
        in_order = centres[order]
        is_new = np.diff(in_order) > _ROUNDING * np.spacing(np.abs(in_order[1:]))
        first = np.append(0, np.flatnonzero(is_new) + 1)[: len(centres)]
        return cls(kernel, mean, in_order[first], np.add.reduceat(weights[order], first))

    def jet(self, t: Array, order: int) -> Array:
        """Return m⁺ and its time derivatives up to `order` at t [s]; the shape is (order + 1, *t.shape).

        If the kernel is a sum of polynomials times e^(−λ|r|), it is evaluated from moments when that is faster.
        """
        t = np.asarray(t, dtype=float)
        if len(self.centres) >= _LONG and t.size * len(self.centres) > _MANY_OF_MOMENTS and self.kernel.decays:
            jet = self._by_moments.jet(t, order)
        else:
            jet = self._blocks(t, order, self.kernel.negligible_distance)
        jet[0] += self.mean
        return jet

    def __call__(self, t: Array) -> Array:
        return np.asarray(self.jet(t, 0)[0])

    def summed(self, t: Array) -> Array:
        """Return m⁺ at t [s] as plain sums of products. Certificates bound the rounding errors of this evaluation."""
        return np.asarray(self._blocks(np.asarray(t, dtype=float), 0, self.kernel.vanishing_distance)[0] + self.mean)

    def derivative(self, t: Array) -> Array:
        return np.asarray(self.jet(t, 1)[1])

    def _blocks(self, t: Array, order: int, reach: float) -> Array:
        """Return the sums and their derivatives at t [s], without the mean: of the centres within `reach` [s] of t."""
        return in_blocks(partial(self._products, order, reach), t, len(self.centres) * (order + 1))

    def _products(self, order: int, reach: float, t: Array) -> Array:
        centres, weights = self.centres, self.weights
        if len(centres) >= _LONG and np.isfinite(reach) and t.size:  # leave out what lies beyond reach of all times
            centres, weights = self._in_order
            first, last = np.searchsorted(centres, [np.min(t) - reach, np.max(t) + reach]).tolist()
            centres, weights = centres[first:last], weights[first:last]
        return np.asarray(self.kernel.jet(t[..., None] - centres, order) @ weights)

    @cached_property
    def _by_moments(self) -> MomentSum:
        return MomentSum([each.only(0) for each in self.kernel.decays], self.centres, self.weights)

    @cached_property
    def _in_order(self) -> tuple[Array, Array]:
        """Centres in increasing order, and their weights."""
        order = np.argsort(self.centres, kind="stable")
        return self.centres[order], self.weights[order]
