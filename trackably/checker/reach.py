"""How far a kernel reaches: where many centres are far away, one bound of all of them takes the place of their sum."""

from functools import lru_cache
from typing import NamedTuple

from trackably.checker.arithmetic.intervals import ZERO, exactly
from trackably.checker.kernels.base import Decay, Kernel
from trackably.checker.watch import tick

_HALVINGS = 15


class Reach(NamedTuple):
    """A distance [s], infinite where there is none, and bounds of |κ| and |κ̇| at all larger distances."""

    distance: float
    decay: Decay


@lru_cache
def reach(kernel: Kernel, span: float, part: float) -> Reach:
    """Return a small distance from which on |κ| ≤ `part` · κ(0), of some that are smaller than the `span` [s]."""
    most, found = kernel.peak.size * part, Reach(float("inf"), Decay(ZERO, ZERO))
    for k in range(1, 4 * _HALVINGS):
        tick()
        distance = span * 2.0 ** (-k / 4)
        decay = kernel.beyond(exactly(distance))
        if not decay.size.b <= most.a:
            break
        found = Reach(distance, decay)
    return found
