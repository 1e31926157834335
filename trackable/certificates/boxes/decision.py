"""Decide in which boxes a quantity stays inside its bounds: in float64, and in ball arithmetic where it matters."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np
from flint import arb

from trackable.arrays import Array
from trackable.certificates.balls.arithmetic import ball_arithmetic
from trackable.certificates.balls.formulas import UndefinedError, require_of
from trackable.certificates.balls.models import Enclosure, Models
from trackable.certificates.boxes.boxes import Boxes
from trackable.certificates.boxes.enclosures import Enclosures, model
from trackable.certificates.boxes.positive import are_positive
from trackable.certificates.boxes.together import Combination
from trackable.certificates.enclosure import ENLARGED, arguments_in, of_arguments
from trackable.certificates.exact import ExactQuantity
from trackable.certificates.floats.balls import Balls, Mask, joined
from trackable.certificates.rounding.flat import FormulaRounding
from trackable.certificates.sketch import Sketch
from trackable.gp.factors.cached import cached
from trackable.systems.formulas.evaluation import evaluate
from trackable.systems.formulas.expression import Variable

_OPEN = 0.25
"""Ball arithmetic decides where the rounding of float64 leaves more than this part of a margin open."""
_LARGER = 1.05
"""Errors are bounded with this factor to spare: a checker with slightly cruder bounds then still agrees."""
_ROUNDING = "the error of its float64 evaluation may be larger than it is on either side of this box"


@dataclass(frozen=True, eq=False)
class Limited:
    """A quantity that has to stay inside its bounds, both drawn in by `reserve`.

    Where there is a `rounding`, its error has to be shown to be at most the reserve in each box.
    """

    quantity: ExactQuantity
    reserve: float
    rounding: FormulaRounding | None

    @cached
    def ends(self) -> tuple[arb, arb]:
        """The bounds, drawn in."""
        with ball_arithmetic():
            bounds, reserve = self.quantity.bounds, arb(self.reserve)
            return arb(bounds.lower) + reserve, arb(bounds.upper) - reserve

    @cached
    def limits(self) -> tuple[Balls, Balls]:
        """The bounds, drawn in, in float64: shape (1,) each."""
        lower, upper = (Balls.of(end) for end in self.ends)
        return Balls(lower.mid[None], lower.rad[None]), Balls(upper.mid[None], upper.rad[None])

    @property
    def is_linear(self) -> bool:
        """Whether the quantity is a functional, of which nothing else is needed."""
        return isinstance(self.quantity.formula, Variable) and not self.quantity.needs

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


@dataclass(frozen=True, eq=False)
class Bounded(Limited):
    """The same, and a `sketch` of the quantity's margins."""

    sketch: Sketch


class Decision(NamedTuple):
    """Where the quantity certainly stays inside, where it is certainly outside in the middle: shape (B,) each.

    `reasons` say by box why a formula may be undefined.
    """

    inside: Mask
    outside: Mask
    reasons: dict[int, str]

    @classmethod
    def none(cls, count: int) -> Self:
        """Return that nothing is certain in so many boxes."""
        return cls(np.zeros(count, dtype=bool), np.zeros(count, dtype=bool), {})

    def put(self, b: int, bounded: Limited, arguments: Mapping[str, Enclosure], terms: int) -> None:
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


def worth_trying(quantities: Sequence[Bounded], enclosures: Enclosures, wanted: Mask) -> Mask:
    """Return which of the `wanted` boxes may be narrow enough, by a cheap estimate: shape (Q, B) both."""
    of, boxes = enclosures.signals, enclosures.boxes
    enclosures.find_remainders(of.needed(wanted))
    found = np.zeros_like(wanted)
    for q, (bounded, arguments) in enumerate(zip(quantities, of.arguments, strict=True)):
        seen = bounded.sketch.within(boxes.starts, boxes.ends)
        sizes = _weighted(seen.steepest, _missed(enclosures, arguments), len(boxes))
        found[q] = wanted[q] & (sizes <= (seen.smallest - bounded.reserve) / 2)
    return found


def decide(quantities: Sequence[Bounded], enclosures: Enclosures, tried: Mask) -> list[Decision]:
    """Decide about the boxes that are `tried` for each quantity: shape (Q, B)."""
    tries = _decided(quantities, enclosures, tried)
    for bounded, each in zip(quantities, tries, strict=True):
        for b in each.left_open_by_rounding(bounded.sketch, enclosures.boxes):
            arguments = arguments_in(bounded.quantity, enclosures.boxes.box(b), enclosures.terms)
            each.decision.put(b, bounded, arguments, enclosures.terms)
    return [each.decision for each in tries]


def are_inside(quantities: Sequence[Limited], enclosures: Enclosures, tried: Mask) -> Mask:
    """Return in which of the `tried` boxes quantities stay inside as far as float64 can tell: shape (Q, B) both."""
    return np.stack([each.decision.inside for each in _decided(quantities, enclosures, tried)])


def _decided(quantities: Sequence[Limited], enclosures: Enclosures, tried: Mask) -> list["_Try"]:
    """Decide by Taylor polynomials in float64; what their rounding leaves open is not decided."""
    of, decisions = enclosures.signals, [Decision.none(tried.shape[1]) for _ in quantities]
    enclosures.find_remainders(of.needed(tried))
    enclosures.find_polynomials(of.needed(tried))
    missed = [_missed(enclosures, arguments) for arguments in of.arguments]
    series = [{name: enclosures.polynomials(each) for name, each in found.items()} for found in of.arguments]
    tries = [_Try(*each) for each in zip(quantities, decisions, series, missed, tried, strict=True)]
    _decide_linear([each for each in tries if each.limited.is_linear])
    _decide_formulas([each for each in tries if not each.limited.is_linear])
    return tries


def _missed(enclosures: Enclosures, arguments: Mapping[str, Combination]) -> dict[str, Array]:
    """Bound the errors of the Taylor polynomials of a quantity's arguments: shape (B,) each."""
    return {name: enclosures.remainders(each) for name, each in arguments.items()}


class _Try(NamedTuple):
    """What is known of a quantity in boxes that are `tried`: Taylor polynomials of its arguments, and their errors."""

    limited: Limited
    decision: Decision
    series: Mapping[str, Balls]
    missed: Mapping[str, Array]
    tried: Mask

    def left_open_by_rounding(self, sketch: Sketch, boxes: Boxes) -> list[int]:
        """Return the boxes without a proof in which the rounding of float64 takes a large part of the margin."""
        is_open = np.flatnonzero(self.tried & ~self.decision.inside)
        if not is_open.size:
            return []
        seen = sketch.within(boxes.starts[is_open], boxes.ends[is_open])
        rounding = {name: np.sum(each.rad[:, is_open], axis=0) for name, each in self.series.items()}
        rounded = _weighted(seen.steepest, rounding, len(is_open))
        found: list[int] = is_open[~(rounded <= _OPEN * (seen.smallest - self.limited.reserve))].tolist()
        return found


def _decide_linear(tries: Sequence[_Try]) -> None:
    """Decide about quantities that are functionals, by Taylor polynomials in float64."""
    if not tries:
        return
    counts = [int(np.count_nonzero(each.tried)) for each in tries]
    q = joined(series.at((slice(None), each.tried)) for each in tries for series in each.series.values())
    rest = np.concatenate([missed[each.tried] for each in tries for missed in each.missed.values()])
    lower, upper = (joined(ends).at(np.repeat(np.arange(len(tries)), counts)) for ends in _limits(tries))
    above, below = q.at(0) - lower, upper - q.at(0)
    outside = (above.highest < -rest) | (below.highest < -rest)
    is_inside = np.all(are_positive(_between(q, above - rest, below - rest)).reshape(2, -1), axis=0)
    first = 0
    for each, count in zip(tries, counts, strict=True):
        of = slice(first, first := first + count)
        each.decision.outside[each.tried], each.decision.inside[each.tried] = outside[of], is_inside[of]


def _limits(tries: Sequence[_Try]) -> tuple[list[Balls], ...]:
    """Return the lower limits of some quantities, and the upper ones: shape (1,) each."""
    limits = [each.limited.limits for each in tries]
    return [lower for lower, _ in limits], [upper for _, upper in limits]


def _decide_formulas(tries: Sequence[_Try]) -> None:
    """Decide about formulas, by Taylor models in ball arithmetic."""
    for limited, decision, series, missed, tried in tries:
        for b in np.flatnonzero(tried).tolist():
            arguments = {name: model(q.at((slice(None), b)), float(missed[name][b])) for name, q in series.items()}
            decision.put(b, limited, arguments, len(next(iter(series.values())).mid))


def _between(q: Balls, above: Balls, below: Balls) -> Balls:
    """Return q and −q with the first coefficients replaced: shape (terms, 2 B)."""
    mid, rad = np.concatenate([q.mid, -q.mid], axis=1), np.concatenate([q.rad, q.rad], axis=1)
    mid[0], rad[0] = np.concatenate([above.mid, below.mid]), np.concatenate([above.rad, below.rad])
    return Balls(mid, rad)


def _weighted(slopes: Mapping[str, Array], sizes: Mapping[str, Array], count: int) -> Array:
    """Return Σ |∂q/∂q_i| size_i in so many boxes: 0 for a formula that depends on no argument."""
    return sum((slopes[name] * size for name, size in sizes.items() if name in slopes), np.zeros(count))
