"""Enclosures of shifted signals and of functionals in boxes, in float64: each is computed once where it is needed."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from flint import arb, arb_poly

from trackable.arrays import Array
from trackable.certificates.balls.arithmetic import ball_arithmetic
from trackable.certificates.balls.models import Enclosure
from trackable.certificates.boxes import few
from trackable.certificates.boxes.boxes import Boxes
from trackable.certificates.boxes.nearby import Summands
from trackable.certificates.boxes.signals import missed, polynomials
from trackable.certificates.exact import ExactFunctional, ShiftedSignal
from trackable.certificates.floats.balls import Balls, Mask, sums_up

_ENLARGED = 1.0625
"""Remainders are enlarged by this factor: a checker with slightly cruder bounds then still agrees."""


@dataclass(frozen=True, eq=False)
class Enclosures:
    """Enclosures with so many `terms` in `boxes`. Numbers that nobody has asked for are NaN."""

    boxes: Boxes
    terms: int
    summands: Mapping[ShiftedSignal, Summands]
    _remainders: dict[ShiftedSignal, Array] = field(default_factory=dict)
    _polynomials: dict[ShiftedSignal, Balls] = field(default_factory=dict)

    def remainders(self, functional: ExactFunctional, wanted: Mask) -> Array:
        """Bound the error of a functional's Taylor polynomials in the `wanted` boxes: shape (B,)."""
        total = np.zeros(len(self.boxes))
        for weight, shifted in functional.terms:
            total += Balls.of(weight).size * self._remainder(shifted, wanted)
        return sums_up(_ENLARGED * total, len(functional.terms))

    def polynomials(self, functional: ExactFunctional, wanted: Mask) -> Balls:
        """Return a functional's Taylor polynomials in the `wanted` boxes: shape (terms, B)."""
        total = Balls(*np.zeros((2, self.terms, len(self.boxes))))
        for weight, shifted in functional.terms:
            total += self._polynomial(shifted, wanted) * weight
        offset = np.zeros((self.terms, 1))
        offset[0] = 1
        return total + Balls.exact(offset) * functional.offset

    def _remainder(self, shifted: ShiftedSignal, wanted: Mask) -> Array:
        found = self._remainders.setdefault(shifted, np.full(len(self.boxes), np.nan))
        if np.any(new := wanted & np.isnan(found)):
            boxes = self.boxes.at(new)
            if few.are_few(shifted, boxes):
                found[new] = few.missed(shifted, boxes, self.terms)
            else:
                found[new] = missed(self.summands[shifted], boxes, self.terms)
        return found

    def _polynomial(self, shifted: ShiftedSignal, wanted: Mask) -> Balls:
        shape = (2, self.terms, len(self.boxes))
        found = self._polynomials.setdefault(shifted, Balls(*np.full(shape, np.nan)))
        if np.any(new := wanted & np.isnan(found.mid[0])):
            boxes = self.boxes.at(new)
            if few.are_few(shifted, boxes):
                series = few.polynomials(shifted, boxes, self.terms)
            else:
                series = polynomials(self.summands[shifted], boxes, self.terms)
            found.mid[:, new], found.rad[:, new] = series.mid, series.rad
        return found


def model(coefficients: Balls, remainder: float) -> Enclosure:
    """Return one enclosure, with coefficients of shape (terms,), in ball arithmetic."""
    with ball_arithmetic():
        balls = zip(coefficients.mid.tolist(), coefficients.rad.tolist(), strict=True)
        return Enclosure(arb_poly([arb(mid, rad) for mid, rad in balls]), arb(remainder))
