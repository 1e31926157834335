"""Certificates of polynomial pieces whose bounds are next to their extremes, one of each claim."""

from fractions import Fraction
from typing import Any

import numpy as np

from tests.splines.draws import cubic, from_scipy
from tests.splines.naive import extremes
from tests.trackably.certificates.decoded import as_read
from tests.trackably.checker.tight import with_bounds
from tests.trackably.plants import AXIS
from trackably.certificates.certificate import Certificate
from trackably.certificates.prove import prove
from trackably.checker.certificate import Window
from trackably.systems.reference import Reference

WINDOW = (0.25, 2.75)
ROOM = 1e-7


def reference(beyond: str) -> Reference:
    """The axis follows a cubic spline, with bounds that leave a hair of room at each extreme."""
    spline = cubic([0.0, 1.0, 2.0, 3.0], [-0.5, -0.25, -0.75, -0.5], beyond)
    free = Reference((from_scipy(spline, beyond),), AXIS)
    ends = [extremes(q.functional, free.pieces, *map(Fraction, times(beyond))) for q in free.quantities]
    low, high = np.array(ends, dtype=float).T
    return with_bounds(free, low - ROOM, high + ROOM)


def times(beyond: str) -> tuple[float, float]:
    return WINDOW if beyond == "end" else (0.0, 3.0)


def certificate(beyond: str) -> dict[str, Any]:
    found = prove(reference("end"), Window(*WINDOW)) if beyond == "end" else prove(reference(beyond))
    assert isinstance(found, Certificate)
    return as_read(found)
