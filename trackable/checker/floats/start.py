"""Where a reference begins, in float64: what a statement shows of it has six digits."""

import numpy as np

from trackable.checker.arithmetic.intervals import Real, between
from trackable.checker.floats.boxes import many_centres, terms_of
from trackable.checker.floats.intervals import Floats
from trackable.checker.steps.quantities import LinearCombination
from trackable.checker.subject import Subject


def at_zero(subject: Subject, argument: LinearCombination) -> Real | None:
    """Return an interval that contains the linear combination at t = 0; None where nothing is known."""
    found = Floats.of(argument.offset)
    with np.errstate(all="ignore"):
        for shifted, weight in terms_of(argument):
            found = found + many_centres(subject, shifted).at(0.0) * weight
    low, high = (float(end.max()) for end in (found.low, found.high))
    return between(low, high) if np.isfinite([low, high]).all() else None
