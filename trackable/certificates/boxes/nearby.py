"""The centres within reach of boxes, as pairs; all others together are one bound."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from flint import arb

from trackable.arrays import Array
from trackable.certificates.balls.arithmetic import ball_arithmetic
from trackable.certificates.boxes.boxes import Boxes, Indices, ShiftedBoxes, Shifts
from trackable.certificates.floats.balls import Balls, U, sums_up
from trackable.certificates.kernels.base import KernelBalls
from trackable.certificates.kernels.matern import MaternBalls
from trackable.certificates.kernels.squared_exponential import SquaredExponentialBalls
from trackable.certificates.kernels.table import balls_of
from trackable.gp.factors.cached import cached
from trackable.gp.signal import KernelSum

_NEGLIGIBLE = 2.0**-60
"""Of κ(0): less than what one rounding adds, and far less than the reserve for evaluation, which counts all centres."""

FEW = 2**12  # pairs: of fewer all are within reach, as finding out takes longer than it saves
_FRACTIONS = 2.0 ** (-np.arange(48) / 4)
_INSIDE = 1 - 2.0**-20
_SERIES, _PRODUCTS, _FEW_NUMBERS = 2**11, 2**12, 2**14
"""Pairs that are held at once: their series, a few products of each, or a few numbers, stay in the cache."""


@dataclass(frozen=True, eq=False)
class Pairs:
    """Pairs of a box and a centre: `firsts` are where those of each of the `boxes` begin."""

    boxes: Boxes
    shifts: Shifts
    of_box: Indices
    centres: Array
    weights: Array
    firsts: Indices

    @cached
    def differences(self) -> Balls:
        """The differences of the middles of boxes and the centres: shape (P,)."""
        return self.shifts.at(self.of_box).differences(self.boxes.middles.at(self.of_box), self.centres)

    def of_each(self, values: Array) -> Array:
        """Return what belongs to the box of each pair, of numbers of shape (B,)."""
        return np.asarray(values[self.of_box])

    def weighted(self, values: Balls, weights: Array) -> Balls:
        """Return Σ_i w_i v_i over the centres of each box, along the last axis."""
        off = (values.rad + (self.most + 4) * U * np.abs(values.mid)) * np.abs(weights)
        return Balls(self.summed(values.mid * weights), sums_up(self.summed(off), self.most))

    def summed_up(self, values: Array) -> Array:
        """Over-estimate Σ_i |c_i| v_i over the centres of each box, for positive values."""
        return sums_up(self.summed(values * np.abs(self.weights)), self.most)

    def largest(self, values: Array) -> Array:
        """Return the largest value of each box."""
        return np.maximum.reduceat(values, self.firsts)

    def summed(self, values: Array) -> Array:
        """Return Σ_i v_i over the centres of each box, along the last axis."""
        return np.add.reduceat(values, self.firsts, axis=-1)

    @cached
    def most(self) -> int:
        """The number of centres of a box, at most."""
        return int(np.max(np.diff(self.firsts, append=len(self.weights))))


@dataclass(frozen=True, eq=False)
class FullPairs:
    """All pairs of some boxes and some centres: arrays of shape (B, n)."""

    boxes: Boxes
    shifts: Shifts
    centres: Array
    weights: Array

    @property
    def most(self) -> int:
        """The number of centres of a box."""
        return len(self.centres)

    @cached
    def differences(self) -> Balls:
        """The differences of the middles of boxes and the centres."""
        column = (slice(None), None)
        return Shifts(self.shifts.high[column], self.shifts.low[column]).differences(
            self.boxes.middles.at(column), self.centres
        )

    def of_each(self, values: Array) -> Array:
        """Return what belongs to the box of each pair, of numbers of shape (B,)."""
        return values[:, None]

    def summed(self, values: Array) -> Array:
        """Return Σ_i v_i over the centres of each box, along the last axis."""
        return np.asarray((values.reshape(-1, self.most) @ np.ones(self.most)).reshape(values.shape[:-1]))

    def summed_up(self, values: Array) -> Array:
        """Over-estimate Σ_i |c_i| v_i over the centres of each box, for positive values."""
        return sums_up(self.summed(values * np.abs(self.weights)), self.most)


@dataclass(frozen=True, eq=False)
class Summands:
    """Σ_i c_i κ(t − t_i) with the centres in order, and `total` ≥ Σ_i |c_i|."""

    kernel: KernelBalls
    centres: Array
    weights: Array

    @classmethod
    def of(cls, signal: KernelSum) -> "Summands":
        """Return the summands of a signal."""
        order = np.argsort(signal.centres, kind="stable")
        return cls(balls_of(signal.kernel), signal.centres[order], signal.weights[order])

    @cached
    def total(self) -> float:
        """Over-estimate of Σ_i |c_i|."""
        return float(sums_up(np.sum(np.abs(self.weights)), len(self.weights)))

    @property
    def _most_pairs(self) -> int:
        """How many pairs are held at once."""
        if isinstance(self.kernel, MaternBalls):
            return _FEW_NUMBERS
        return _PRODUCTS if isinstance(self.kernel, SquaredExponentialBalls) else _SERIES

    def reach(self, shifted: ShiftedBoxes) -> tuple[Array, Array]:
        """Return a distance [s] from the middle of each box, and a bound of |κ| on the discs of all farther centres.

        The distance is infinite, and the bound zero, where all centres matter.
        """
        boxes, times = shifted.boxes, shifted.times
        if len(boxes) * len(self.centres) <= FEW:
            return np.full(len(boxes), np.inf), np.zeros(len(boxes))
        farthest = np.maximum(np.abs(times - self.centres[0]), np.abs(times - self.centres[-1]))
        distances, radii = farthest[:, None] * _FRACTIONS, boxes.radii[:, None]
        # Distances are compared in float64, and the numbers that they come from are larger than they are.
        sizes = np.abs(boxes.middles.mid) + np.abs(shifted.shifts.high) + np.abs(times) + farthest
        certain = distances * _INSIDE - 2.0**-48 * sizes[:, None]
        with ball_arithmetic():
            largest = Balls.of(self.kernel.beyond(arb(0)).size).lowest
            sizes = self.kernel.far(Balls.exact(certain), Balls.exact(radii)).highest
        sizes = np.broadcast_to(sizes, distances.shape)
        reached = (sizes <= _NEGLIGIBLE * largest) & (certain >= radii)
        last = np.sum(np.logical_and.accumulate(reached, axis=1), axis=1) - 1
        rows, some = np.arange(len(boxes)), last >= 0
        return np.where(some, distances[rows, last], np.inf), np.where(some, sizes[rows, last], 0.0)

    def pairs_or_all(self, shifted: ShiftedBoxes, reach: Array) -> Iterator[Pairs | FullPairs]:
        """Yield all pairs at once where they are few, and what `pairs` yields elsewhere."""
        if len(shifted) * len(self.centres) <= self._most_pairs and np.all(np.isinf(reach)):
            yield FullPairs(shifted.boxes, shifted.shifts, self.centres, self.weights)
        else:
            yield from self.pairs(shifted, reach)

    def pairs(self, shifted: ShiftedBoxes, reach: Array) -> Iterator[Pairs]:
        """Yield the pairs of boxes and their centres within `reach` [s], for blocks of neighbouring boxes."""
        times = shifted.times
        first = np.searchsorted(self.centres, times - reach)
        # At least one: no box is without pairs.
        first = np.minimum(first, len(self.centres) - 1)
        counts = np.maximum(np.searchsorted(self.centres, times + reach, side="right") - first, 1)
        for block in _blocks(counts, self._most_pairs):
            some, starts = counts[block], np.concatenate([[0], np.cumsum(counts[block])[:-1]])
            which = np.arange(np.sum(some)) + np.repeat(first[block] - starts, some)
            of_box = np.repeat(np.arange(len(some)), some)
            where = shifted.at(block)
            yield Pairs(where.boxes, where.shifts, of_box, self.centres[which], self.weights[which], starts)


def _blocks(counts: Indices, most: int) -> Iterator[slice]:
    """Yield slices with about as many pairs as this."""
    first, total = 0, 0
    for b, count in enumerate(counts.tolist()):
        if total and total + count > most:
            yield slice(first, b)
            first, total = b, 0
        total += count
    if total:
        yield slice(first, len(counts))
