"""Decide in which boxes a quantity stays inside its bounds: in float64, and in ball arithmetic where it matters."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from flint import arb

from trackable.arrays import Array
from trackable.certificates.balls.arithmetic import ball_arithmetic
from trackable.certificates.balls.formulas import UndefinedError, require_of
from trackable.certificates.balls.models import Enclosure, Models
from trackable.certificates.boxes.enclosures import Enclosures, model
from trackable.certificates.boxes.positive import are_positive
from trackable.certificates.enclosure import ENLARGED, arguments_in, of_arguments
from trackable.certificates.exact import ExactQuantity
from trackable.certificates.floats.balls import Balls, Mask
from trackable.certificates.rounding.flat import FormulaRounding
from trackable.certificates.sketch import Sketch
from trackable.systems.formulas.evaluation import evaluate
from trackable.systems.formulas.expression import Variable

_OPEN = 0.25
"""Ball arithmetic decides where the rounding of float64 leaves more than this part of a margin open."""
_LARGER = 1.05
"""Errors are bounded with this factor to spare: a checker with slightly cruder bounds then still agrees."""
_ROUNDING = "the error of its float64 evaluation may be larger than it is on either side of this box"


@dataclass(frozen=True, eq=False)
class Bounded:
    """A quantity that has to stay inside its bounds, both drawn in by `reserve`, and a `sketch` of its margins.

    Where there is a `rounding`, its error has to be shown to be at most the reserve in each box.
    """

    quantity: ExactQuantity
    sketch: Sketch
    reserve: float
    rounding: FormulaRounding | None = None

    @cached_property
    def ends(self) -> tuple[arb, arb]:
        """The bounds, drawn in."""
        with ball_arithmetic():
            bounds, reserve = self.quantity.bounds, arb(self.reserve)
            return arb(bounds.lower) + reserve, arb(bounds.upper) - reserve

    def require(self, arguments: Mapping[str, Enclosure], terms: int) -> None:
        """Raise UndefinedError where something that is needed may fail, or rounding may exceed the reserve."""
        if not (self.quantity.needs or self.rounding):
            return
        with ball_arithmetic(terms):
            for needed in self.quantity.needs:
                found = evaluate(needed.formula, arguments, Models())
                require_of(needed, Enclosure(found.coefficients, ENLARGED * found.remainder).span)
            if self.rounding and not _LARGER * self.rounding.error(arguments) <= arb(self.reserve):
                raise UndefinedError(_ROUNDING)


class Decision(NamedTuple):
    """Where the quantity certainly stays inside, where it is certainly outside in the middle: shape (B,) each.

    `reasons` say by box why a formula may be undefined.
    """

    inside: Mask
    outside: Mask
    reasons: dict[int, str]

    def put(self, b: int, bounded: Bounded, arguments: Mapping[str, Enclosure], terms: int) -> None:
        """Decide about one box by enclosures of the arguments in ball arithmetic."""
        try:
            found, (lower, upper) = of_arguments(bounded.quantity, arguments, terms), bounded.ends
            middle = found.coefficients[0] + arb(0, 1) * found.remainder
            self.outside[b] = middle < lower or middle > upper
            if not self.outside[b]:
                bounded.require(arguments, terms)
                self.inside[b] = found.stays_in(lower, upper)
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
            decision.put(b, bounded, arguments_in(quantity, boxes.box(b), enclosures.terms), enclosures.terms)
    return decision


def _decide(
    decision: Decision, bounded: Bounded, series: Mapping[str, Balls], missed: Mapping[str, Array], tried: Mask
) -> None:
    """Decide about the boxes that are `tried` by Taylor polynomials in float64."""
    formula = bounded.quantity.formula
    if isinstance(formula, Variable) and not bounded.quantity.needs:
        q, rest = series[formula.name], missed[formula.name]
        lower, upper = (Balls.of(end) for end in bounded.ends)
        above, below = q.at(0) - lower, upper - q.at(0)
        decision.inside[:] = tried & are_positive(_with(above - rest, q)) & are_positive(_with(below - rest, -q))
        decision.outside[:] = tried & ((above.highest < -rest) | (below.highest < -rest))
        return

    for b in np.flatnonzero(tried).tolist():
        arguments = {name: model(q.at((slice(None), b)), float(missed[name][b])) for name, q in series.items()}
        decision.put(b, bounded, arguments, len(next(iter(series.values())).mid))


def _with(first: Balls, polynomials: Balls) -> Balls:
    """Replace first coefficients."""
    return Balls(np.vstack([first.mid, polynomials.mid[1:]]), np.vstack([first.rad, polynomials.rad[1:]]))


def _weighted(slopes: Mapping[str, Array], sizes: Mapping[str, Array]) -> Array:
    return np.asarray(sum(slopes[name] * size for name, size in sizes.items() if name in slopes))
