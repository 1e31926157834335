"""Boxes of time as arrays: the times relative to each centre, in float64 with outward rounding."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
import numpy.typing as npt

from trackable.arrays import Array
from trackable.certificates.balls.arithmetic import ball_arithmetic
from trackable.certificates.enclosure import Box
from trackable.certificates.exact import ShiftedSignal
from trackable.certificates.floats.balls import Balls, Mask, U
from trackable.gp.factors.cached import cached

Indices = npt.NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Shifts:
    """Shifts s [s], each exactly the sum of two float64 numbers: shape (S,)."""

    high: Array
    low: Array

    @classmethod
    def of(cls, shifted: Sequence[ShiftedSignal]) -> Self:
        """Return the shifts of signals: small multiples of a float64 number, so that two are enough."""
        high = [float(each.shift) for each in shifted]
        with ball_arithmetic():
            rest = [each.shift - h for each, h in zip(shifted, high, strict=True)]
            low = [float(each) for each in rest]
            assert all(each - of == 0 for each, of in zip(rest, low, strict=True)), "a shift has few digits"
        return cls(np.array(high), np.array(low))

    def at(self, index: slice | Mask | Indices) -> Self:
        """Return some of the shifts."""
        return type(self)(self.high[index], self.low[index])

    def differences(self, times: Balls, centres: Array) -> Balls:
        """Return times + s − centres: each of the three sums is rounded once."""
        shifted = times.mid + self.high
        far = shifted - centres
        mid = far + self.low
        off = times.rad + U * (np.abs(shifted) + np.abs(far) + np.abs(mid))
        return Balls(mid, off * (1 + 16 * U))

    def signs(self, times: Array, centres: Array) -> Array:
        """Return the signs of times + s − centres, exactly: −1, 0 or 1."""
        found = self.differences(Balls.exact(times), centres)
        signs = np.sign(found.mid)
        for at in np.flatnonzero(np.abs(found.mid) <= 2 * found.rad):
            signs[at] = np.sign(math.fsum((times[at], self.high[at], self.low[at], -centres[at])))
        return signs


@dataclass(frozen=True, eq=False)
class Boxes:
    """All real times in [starts, ends] [s], and the `radii` [s] of the discs in Cauchy's estimate; shape (B,)."""

    starts: Array
    ends: Array
    radii: Array

    @classmethod
    def joined(cls, parts: Sequence["Boxes"]) -> Self:
        """Join boxes, in the order of the parts."""
        starts, ends, radii = zip(*((each.starts, each.ends, each.radii) for each in parts), strict=True)
        return cls(np.concatenate(starts), np.concatenate(ends), np.concatenate(radii))

    def __len__(self) -> int:
        return len(self.starts)

    def box(self, b: int) -> Box:
        """Return one of the boxes."""
        return Box(float(self.starts[b]), float(self.ends[b]), float(self.radii[b]))

    def at(self, index: slice | Mask | Indices) -> Self:
        """Return some of the boxes."""
        return type(self)(self.starts[index], self.ends[index], self.radii[index])

    @property
    def can_be_split(self) -> Mask:
        """Whether there is a float64 number between the ends of a box."""
        middles = self.starts + (self.ends - self.starts) / 2
        return np.asarray((self.starts < middles) & (middles < self.ends))

    @cached
    def middles(self) -> Balls:
        """The midpoints [s]."""
        return (Balls.exact(self.starts) + self.ends) * 0.5

    @cached
    def halves(self) -> Balls:
        """Half of the widths [s]."""
        return (Balls.exact(self.ends) - self.starts) * 0.5


@dataclass(frozen=True, eq=False)
class ShiftedBoxes:
    """Boxes, with the shift of the signal that is enclosed in each of them: shape (B,)."""

    boxes: Boxes
    shifts: Shifts

    def __len__(self) -> int:
        return len(self.boxes)

    def at(self, index: slice | Mask | Indices) -> Self:
        """Return some of the boxes."""
        return type(self)(self.boxes.at(index), self.shifts.at(index))

    @property
    def times(self) -> Array:
        """The middles + s [s], nearly."""
        return self.boxes.middles.mid + self.shifts.high
