"""Which discs are tried in a box. Nothing here is believed by a proof."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from trackable.arrays import Array
from trackable.certificates.balls.arithmetic import ball_arithmetic
from trackable.certificates.boxes import gaussians
from trackable.certificates.boxes.boxes import Boxes
from trackable.certificates.boxes.together import Group
from trackable.certificates.floats.balls import Balls
from trackable.certificates.kernels.squared_exponential import SquaredExponentialBalls

_RATIOS = np.array([1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 13.0, 16.0, 20.0, 26.0, 32.0, 64.0, 128.0])


@dataclass(frozen=True, eq=False)
class Choice:
    """Boxes for all of these signals: so quantities share boxes, and each signal is enclosed once in a box."""

    groups: Sequence[Group]
    terms: int

    def boxes(self, starts: Array, ends: Array) -> Boxes:
        """Return boxes with discs that make remainders small. Every radius is valid."""
        halves, middles = (ends - starts) / 2, starts + (ends - starts) / 2
        radii = halves * _RATIOS[:, None]
        with np.errstate(all="ignore"), ball_arithmetic():
            bounds = sum(self._on_discs(group, middles, radii) for group in self.groups)
            sizes = bounds * (halves / radii) ** self.terms
        best = np.argmin(np.where(np.isfinite(sizes), sizes, np.inf), axis=0)
        return Boxes(starts, ends, radii[best, np.arange(len(starts))])

    def _on_discs(self, group: Group, middles: Array, radii: Array) -> Array:
        """Bound κ on discs around the nearest centre's difference; for periodic kernels, whose maxima are near, 0.

        The sum for all shifts of a signal.
        """
        summands = group.summands
        times, centres = middles + group.shifts.high[:, None, None], summands.centres
        after = np.minimum(np.searchsorted(centres, times), len(centres) - 1)
        nearest = np.minimum(np.abs(times - centres[after]), np.abs(times - centres[np.maximum(after - 1, 0)]))
        if summands.kernel.has_periodic_part:
            nearest = np.zeros_like(nearest)
        if isinstance(summands.kernel, SquaredExponentialBalls):
            bounds = gaussians.nearly_on_discs(summands.kernel, nearest, radii)
        else:
            bounds = Balls.of(summands.kernel.on_disc(Balls.exact(nearest), Balls.exact(radii))).highest
        return np.asarray(np.sum(bounds, axis=0))
