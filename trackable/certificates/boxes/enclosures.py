"""Enclosures of shifted signals and of functionals in boxes, in float64: each is computed once where it is needed."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from flint import arb, arb_poly

from trackable.arrays import Array
from trackable.certificates.balls.arithmetic import ball_arithmetic
from trackable.certificates.balls.models import Enclosure
from trackable.certificates.boxes.boxes import Boxes, Indices, ShiftedBoxes
from trackable.certificates.boxes.signals import missed, polynomials
from trackable.certificates.boxes.together import Combination, Group, Together
from trackable.certificates.floats.balls import Balls, Mask, U, sums_up
from trackable.gp.factors.cached import cached

_ENLARGED = 1.0625
"""Remainders are enlarged by this factor: a checker with slightly cruder bounds then still agrees."""


@dataclass(frozen=True, eq=False)
class Enclosures:
    """Enclosures with so many `terms` in `boxes`. Numbers that nobody has asked for are NaN."""

    boxes: Boxes
    terms: int
    signals: Together

    @classmethod
    def joined(cls, parts: "Sequence[Enclosures]") -> Self:
        """Join the boxes of some enclosures of the same signals; their remainders stay known."""
        found = cls(Boxes.joined([each.boxes for each in parts]), parts[0].terms, parts[0].signals)
        np.concatenate([each._remainders for each in parts], axis=1, out=found._remainders)
        return found

    def at(self, index: Mask) -> Self:
        """Return the enclosures in some of the boxes; their remainders stay known."""
        found = type(self)(self.boxes.at(index), self.terms, self.signals)
        found._remainders[:] = self._remainders[:, index]
        return found

    def find_remainders(self, wanted: Mask) -> None:
        """Find what `remainders` needs, of the `wanted` shifted signals in the wanted boxes: shape (S, B)."""
        for group, at, boxes in self._in_groups(wanted & np.isnan(self._remainders)):
            self._remainders[at] = missed(group.summands, boxes, self.terms)

    def find_polynomials(self, wanted: Mask) -> None:
        """Find what `polynomials` needs, of the `wanted` shifted signals in the wanted boxes: shape (S, B)."""
        known = self._polynomials
        for group, (s, b), boxes in self._in_groups(wanted & np.isnan(known.mid[0])):
            found = polynomials(group.summands, boxes, self.terms)
            known.mid[:, s, b], known.rad[:, s, b] = found.mid, found.rad

    def remainders(self, combination: Combination) -> Array:
        """Bound the error of a functional's Taylor polynomials in each box where it is known: shape (B,)."""
        weighted = combination.weights.size[:, None] * self._remainders[combination.rows]
        return sums_up(_ENLARGED * np.sum(weighted, axis=0), len(weighted))

    def polynomials(self, combination: Combination) -> Balls:
        """Return a functional's Taylor polynomials in each box where they are known: shape (terms, B)."""
        w, of = combination.weights, self._polynomials.at((slice(None), combination.rows))
        size = np.abs(of.mid)
        rounded = of.rad + (len(w.mid) + 4) * U * size
        off = np.abs(w.mid)[:, None] * rounded + w.rad[:, None] * (size + of.rad)
        total = Balls(np.sum(w.mid[:, None] * of.mid, axis=1), sums_up(np.sum(off, axis=1), 2 * len(w.mid)))
        first = total.at(0) + combination.offset
        total.mid[0], total.rad[0] = first.mid, first.rad
        return total

    @cached
    def _remainders(self) -> Array:
        return np.full((len(self.signals), len(self.boxes)), np.nan)

    @cached
    def _polynomials(self) -> Balls:
        return Balls(*np.full((2, self.terms, len(self.signals), len(self.boxes)), np.nan))

    def _in_groups(self, wanted: Mask) -> Iterator[tuple[Group, tuple[Indices, Indices], ShiftedBoxes]]:
        """Yield each group with the indices of what is wanted of it, of shifted signals and of boxes."""
        for group in self.signals.groups:
            s, b = np.nonzero(wanted[group.rows])
            if len(s):
                yield group, (group.rows.start + s, b), ShiftedBoxes(self.boxes.at(b), group.shifts.at(s))


def model(coefficients: Balls, remainder: float) -> Enclosure:
    """Return one enclosure, with coefficients of shape (terms,), in ball arithmetic."""
    with ball_arithmetic():
        balls = zip(coefficients.mid.tolist(), coefficients.rad.tolist(), strict=True)
        return Enclosure(arb_poly([arb(mid, rad) for mid, rad in balls]), arb(remainder))
