"""Which boxes are tried: where a box is split, and with which discs. Nothing here is believed by a proof."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from trackable.arrays import Array
from trackable.certificates.balls.arithmetic import ball_arithmetic
from trackable.certificates.boxes.boxes import Boxes
from trackable.certificates.boxes.nearby import Summands
from trackable.certificates.floats.balls import Balls

_RATIOS = np.array([1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 13.0, 16.0, 20.0, 26.0, 32.0, 64.0, 128.0])
_FEW = 2  # places with kinks in a box, at most, that is split there
_SAME = 2.0**-48
"""Kinks that are so close together, relative to their time, lie in one narrow box."""


@dataclass(frozen=True, eq=False)
class Choice:
    """Boxes for all of these signals: so quantities share boxes, and each signal is enclosed once in a box."""

    signals: Sequence[Summands]
    terms: int

    def boxes(self, starts: Array, ends: Array) -> Boxes:
        """Return boxes with discs that make remainders small. Every radius is valid."""
        halves, middles = (ends - starts) / 2, starts + (ends - starts) / 2
        radii = halves * _RATIOS[:, None]
        with np.errstate(all="ignore"), ball_arithmetic():
            bounds = sum(self._on_discs(summands, middles, radii) for summands in self.signals)
            sizes = bounds * (halves / radii) ** self.terms
        best = np.argmin(np.where(np.isfinite(sizes), sizes, np.inf), axis=0)
        return Boxes(starts, ends, radii[best, np.arange(len(starts))])

    def _on_discs(self, summands: Summands, middles: Array, radii: Array) -> Array:
        """Bound κ on discs around the nearest centre's difference; for periodic kernels, whose maxima are near, 0."""
        times, centres = middles + summands.shift.high, summands.centres
        after = np.minimum(np.searchsorted(centres, times), len(centres) - 1)
        nearest = np.minimum(np.abs(times - centres[after]), np.abs(times - centres[np.maximum(after - 1, 0)]))
        if summands.kernel.has_periodic_part:
            nearest = np.zeros_like(nearest)
        return Balls.of(summands.kernel.on_disc(Balls.exact(nearest), Balls.exact(radii))).highest

    @cached_property
    def _kinks(self) -> tuple[Array, Array]:
        """The beginnings and ends [s] of narrow intervals with all kinks; at exact kinks of one signal they agree."""
        times = np.unique(np.concatenate([np.empty(0), *(summands.kinks for summands in self.signals)]))
        if not len(times):
            return times, times
        exact = np.isin(times, np.concatenate([s.centres for s in self.signals if not s.shift.high and s.kernel.kinks]))
        off = np.abs(times) * _SAME
        new = np.concatenate([[True], times[1:] - off[1:] > times[:-1] + off[:-1]])
        first = np.flatnonzero(new)
        last = np.concatenate([first[1:] - 1, [len(times) - 1]])
        alone = (first == last) & exact[first]
        starts, ends = times[first] - off[first], times[last] + off[last]
        return np.where(alone, times[first], starts), np.where(alone, times[first], ends)

    @property
    def kink_count(self) -> int:
        """The number of places [s] with kinks."""
        return len(self._kinks[0])

    def parts(self, start: float, end: float, at_kink: bool) -> list[float]:
        """Return where a box is split: in the middle, or before and after the kinks that are nearest to it."""
        middle, (befores, afters) = start + (end - start) / 2, self._kinks
        inside = slice(np.searchsorted(befores, start, side="right"), np.searchsorted(afters, end, side="left"))
        before, after = befores[inside], afters[inside]
        if not (at_kink and 0 < len(before) <= _FEW):
            return [middle]
        nearest = np.argmin(np.abs(before - middle))
        return sorted({float(before[nearest]), float(after[nearest])})
