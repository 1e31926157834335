"""Enclosures of few centres in few boxes: by ball arithmetic, one by one, which is faster there than arrays are."""

import numpy as np

from trackable.arrays import Array
from trackable.certificates import enclosure
from trackable.certificates.balls.arithmetic import float_above
from trackable.certificates.boxes.boxes import Boxes
from trackable.certificates.exact import ShiftedSignal
from trackable.certificates.floats.balls import Balls

_FEW = 150  # pairs of a box and a centre


def are_few(shifted: ShiftedSignal, boxes: Boxes) -> bool:
    """Whether there are few pairs of a box and a centre."""
    return len(boxes) * len(shifted.signal.centres) <= _FEW


def missed(shifted: ShiftedSignal, boxes: Boxes, terms: int) -> Array:
    """Do what `signals.missed` does."""
    return np.array([float_above(enclosure.missed(shifted, boxes.box(b), terms)) for b in range(len(boxes))])


def polynomials(shifted: ShiftedSignal, boxes: Boxes, terms: int) -> Balls:
    """Do what `signals.polynomials` does."""
    mid, rad = np.zeros((2, terms, len(boxes)))
    for b in range(len(boxes)):
        for k, coefficient in enumerate(enclosure.polynomial(shifted, boxes.box(b), terms).coeffs()):
            ball = Balls.of(coefficient)
            mid[k, b], rad[k, b] = ball.mid, ball.rad
    return Balls(mid, rad)
