"""Decide in which boxes a quantity stays inside its bounds: in float64, and in ball arithmetic where it matters."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from flint import arb

from trackable.arrays import Array
from trackable.certificates.balls.arithmetic import ball_arithmetic
from trackable.certificates.balls.formulas import UndefinedError
from trackable.certificates.balls.models import Enclosure
from trackable.certificates.boxes.enclosures import Enclosures, model
from trackable.certificates.boxes.positive import are_positive
from trackable.certificates.enclosure import enclosure, of_arguments
from trackable.certificates.exact import ExactQuantity
from trackable.certificates.floats.balls import Balls, Mask
from trackable.certificates.sketch import Sketch
from trackable.systems.formulas.expression import Variable

_OPEN = 0.25
"""Ball arithmetic decides where the rounding of float64 leaves more than this part of a margin open."""


@dataclass(frozen=True, eq=False)
class Bounded:
    """A quantity that has to stay inside its bounds, both drawn in by `reserve`, and a `sketch` of its margins."""

    quantity: ExactQuantity
    sketch: Sketch
    reserve: float

    @cached_property
    def ends(self) -> tuple[arb, arb]:
        """The bounds, drawn in."""
        with ball_arithmetic():
            bounds, reserve = self.quantity.bounds, arb(self.reserve)
            return arb(bounds.lower) + reserve, arb(bounds.upper) - reserve


class Decision(NamedTuple):
    """Where the quantity certainly stays inside, where it is certainly outside in the middle: shape (B,) each.

    `reasons` say by box why a formula may be undefined.
    """

    inside: Mask
    outside: Mask
    reasons: dict[int, str]

    def put(self, b: int, bounded: Bounded, enclosed: Callable[[int], Enclosure]) -> None:
        """Decide about one box by its enclosure in ball arithmetic."""
        try:
            found, (lower, upper) = enclosed(b), bounded.ends
            self.inside[b] = found.stays_in(lower, upper)
            middle = found.coefficients[0] + arb(0, 1) * found.remainder
            self.outside[b] = middle < lower or middle > upper
        except UndefinedError as undefined:
            self.reasons[b] = str(undefined)


def decide(bounded: Bounded, enclosures: Enclosures, wanted: Mask) -> Decision:
    """Decide about the `wanted` boxes."""
    quantity, boxes = bounded.quantity, enclosures.boxes
    margins = bounded.sketch.smallest(boxes.starts, boxes.ends) - bounded.reserve
    slopes = bounded.sketch.steepest(boxes.starts, boxes.ends)
    missed = {name: enclosures.remainders(q, wanted) for name, q in quantity.arguments.items()}
    # A cheap estimate rejects boxes that are much too wide.
    tried = wanted & (_weighted(slopes, missed) <= margins / 2)
    decision = Decision(np.zeros_like(tried), np.zeros_like(tried), {})
    if np.any(tried):
        series = {name: enclosures.polynomials(q, tried) for name, q in quantity.arguments.items()}
        _decide(decision, bounded, series, missed, tried)
        rounded = _weighted(slopes, {name: np.sum(q.rad, axis=0) for name, q in series.items()})
        for b in np.flatnonzero(tried & ~decision.inside & ~(rounded <= _OPEN * margins)).tolist():
            decision.put(b, bounded, lambda b: enclosure(quantity, boxes.box(b), enclosures.terms))
    return decision


def _decide(
    decision: Decision, bounded: Bounded, series: Mapping[str, Balls], missed: Mapping[str, Array], tried: Mask
) -> None:
    """Decide about the boxes that are `tried` by Taylor polynomials in float64."""
    formula = bounded.quantity.formula
    if isinstance(formula, Variable):
        q, rest = series[formula.name], missed[formula.name]
        lower, upper = (Balls.of(end) for end in bounded.ends)
        above, below = q.at(0) - lower, upper - q.at(0)
        decision.inside[:] = tried & are_positive(_with(above - rest, q)) & are_positive(_with(below - rest, -q))
        decision.outside[:] = tried & ((above.highest < -rest) | (below.highest < -rest))
        return

    def enclosed(b: int) -> Enclosure:
        arguments = {name: model(q.at((slice(None), b)), float(missed[name][b])) for name, q in series.items()}
        return of_arguments(bounded.quantity, arguments, len(next(iter(series.values())).mid))

    for b in np.flatnonzero(tried).tolist():
        decision.put(b, bounded, enclosed)


def _with(first: Balls, polynomials: Balls) -> Balls:
    """Replace first coefficients."""
    return Balls(np.vstack([first.mid, polynomials.mid[1:]]), np.vstack([first.rad, polynomials.rad[1:]]))


def _weighted(slopes: Mapping[str, Array], sizes: Mapping[str, Array]) -> Array:
    return np.asarray(sum(slopes[name] * size for name, size in sizes.items()))
