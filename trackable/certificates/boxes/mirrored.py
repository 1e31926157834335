"""Differences between boxes and centres, mirrored to one side, as kernels are even."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from trackable.arrays import Array
from trackable.certificates.boxes.nearby import Pairs
from trackable.certificates.floats.balls import Balls, Mask
from trackable.certificates.kernels.base import KernelBalls


@dataclass(frozen=True, eq=False)
class Mirrored:
    """Differences r of the middles of boxes and the centres, mirrored to r ≥ 0 by these `signs`.

    `both` says where some times of the box may lie before the centre and some after it. There either sign will do.
    """

    pairs: Pairs
    r: Balls
    signs: Array
    both: Mask

    @classmethod
    def of(cls, kernel: KernelBalls, pairs: Pairs) -> "Mirrored":
        """Return the differences of pairs. Signs are exact where a kernel has kinks."""
        boxes, at, r = pairs.boxes, pairs.of_box, pairs.differences
        signs, both = np.where(r.mid >= 0, 1.0, -1.0), np.zeros(len(at), dtype=bool)
        if kernel.kinks:
            near = np.flatnonzero(np.abs(r.mid) <= 2 * boxes.halves.highest[at] + 4 * r.rad)
            close, centres = pairs.shifts.at(at[near]), pairs.centres[near]
            after = close.signs(boxes.starts[at[near]], centres) >= 0
            before = close.signs(boxes.ends[at[near]], centres) <= 0
            signs[near] = np.where(after, 1.0, np.where(before, -1.0, signs[near]))
            both[near] = ~(after | before)
        return cls(pairs, Balls(r.mid * signs, r.rad), signs, both)

    @cached_property
    def halves(self) -> Balls:
        """Half of the widths of the boxes [s]."""
        return self.pairs.boxes.halves.at(self.pairs.of_box)

    @cached_property
    def radii(self) -> Balls:
        """The radii of the discs [s]."""
        return Balls.exact(self.pairs.boxes.radii[self.pairs.of_box])
