"""Boxes of time as arrays: the times relative to each centre, in float64 with outward rounding."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from trackable.arrays import Array
from trackable.certificates.enclosure import Box
from trackable.certificates.exact import ShiftedSignal
from trackable.certificates.floats.balls import Balls, Mask


@dataclass(frozen=True, eq=False)
class Boxes:
    """All real times in [starts, ends] [s], and the `radii` [s] of the discs in Cauchy's estimate; shape (B,)."""

    starts: Array
    ends: Array
    radii: Array

    def __len__(self) -> int:
        return len(self.starts)

    def box(self, b: int) -> Box:
        """Return one of the boxes."""
        return Box(float(self.starts[b]), float(self.ends[b]), float(self.radii[b]))

    def at(self, index: slice | Mask) -> Self:
        """Return some of the boxes."""
        return type(self)(self.starts[index], self.ends[index], self.radii[index])

    @property
    def can_be_split(self) -> Mask:
        """Whether there is a float64 number between the ends of a box."""
        middles = self.starts + (self.ends - self.starts) / 2
        return np.asarray((self.starts < middles) & (middles < self.ends))

    @cached_property
    def middles(self) -> Balls:
        """The midpoints [s]."""
        return (Balls.exact(self.starts) + self.ends) * 0.5

    @cached_property
    def halves(self) -> Balls:
        """Half of the widths [s]."""
        return (Balls.exact(self.ends) - self.starts) * 0.5


@dataclass(frozen=True, eq=False)
class Shift:
    """A shift s [s], exactly the sum of two float64 numbers."""

    high: float
    low: float

    @classmethod
    def of(cls, shifted: ShiftedSignal) -> Self:
        """Return the shift of a signal: a small multiple of a float64 number, so that two are enough."""
        high = float(shifted.shift)
        low = float(shifted.shift - high)
        assert shifted.shift - high - low == 0, "a shift has few digits"
        return cls(high, low)

    def differences(self, times: Balls, centres: Array) -> Balls:
        """Return times + s − centres."""
        return times + self.high - centres + self.low

    def signs(self, times: Array, centres: Array) -> Array:
        """Return the signs of times + s − centres, exactly: −1, 0 or 1."""
        found = self.differences(Balls.exact(times), centres)
        signs = np.sign(found.mid)
        for at in np.flatnonzero(np.abs(found.mid) <= 2 * found.rad):
            signs[at] = np.sign(math.fsum((times[at], self.high, self.low, -centres[at])))
        return signs
