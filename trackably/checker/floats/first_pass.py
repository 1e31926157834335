"""What is tried in float64 before mpmath."""

from math import isfinite
from typing import Any

import numpy as np

from trackably.checker.arithmetic.intervals import Real, between, exactly
from trackably.checker.floats.boxes import boxes_left, many_centres, terms_of
from trackably.checker.floats.intervals import Floats, sums
from trackably.checker.kernels.base import Decay
from trackably.checker.steps.boxes import FirstPass
from trackably.checker.steps.quantities import LinearCombination
from trackably.checker.subject import Signal, Subject


def envelope(signal: Signal, start: Real) -> Decay | None:
    """Over-estimate |z − m| and |ż| from `start` on; None where nothing is known."""
    with np.errstate(all="ignore"):
        distance: Any = Floats.of(start) - Floats.exact(np.array(signal.centres))
        each = signal.kernel.beyond(distance.choose(distance.low >= 0, distance, 0.0))
        sizes, first = abs(Floats.exact(np.array(signal.weights))), np.zeros(1, dtype=np.intp)
        size, slope = (float(sums(sizes * part, first, len(signal.weights)).high[0]) for part in each)
    return Decay(exactly(size), exactly(slope)) if isfinite(size) and isfinite(slope) else None


def at_zero(subject: Subject, argument: LinearCombination) -> Real | None:
    """Return an interval that contains the linear combination at t = 0; None where nothing is known."""
    found = Floats.of(argument.offset)
    with np.errstate(all="ignore"):
        for shifted, weight in terms_of(argument):
            found = found + many_centres(subject, shifted).at(0.0) * weight
    low, high = (float(end.max()) for end in (found.low, found.high))
    return between(low, high) if isfinite(low) and isfinite(high) else None


def keeps_subnormals() -> bool:
    """Return whether float64 arithmetic is IEEE's near zero: a processor may be set to take tiny numbers for zero."""
    smallest_normal = np.full(8, np.finfo(np.float64).smallest_normal)
    return bool(np.all(smallest_normal / 2 * 2 == smallest_normal))


_TRUSTED = (
    "This was checked in float64 intervals first, which trusts IEEE arithmetic and NumPy's exp, log, sqrt, cos, arctan "
    "and arctan2."
)
FIRST_PASS = FirstPass(boxes_left, envelope, at_zero, keeps_subnormals, _TRUSTED)
"""In arrays of float64 intervals."""
