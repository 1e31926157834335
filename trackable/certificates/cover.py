"""Cover a window with boxes of time: in each box an enclosure of the quantity lies inside the bounds."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from flint import arb

from trackable.certificates.balls.arithmetic import ball_arithmetic, float_above
from trackable.certificates.balls.formulas import UndefinedError
from trackable.certificates.enclosure import Box, best_radius, enclosure, remainder
from trackable.certificates.exact import ExactQuantity, ShiftedSignal
from trackable.certificates.sketch import Sketch
from trackable.progress.work import done

TERMS = 16
_MOST_BOXES = 20_000
_TOO_WIDE = "no enclosure found in this box is narrow enough"


@dataclass(frozen=True)
class Cover:
    """Boxes [ends_k, ends_(k+1)] without gaps, with one of the `radii` each. Times [s] are exact float64 numbers."""

    ends: tuple[float, ...]
    radii: tuple[float, ...]


@dataclass(frozen=True)
class Hole:
    """A box in which no enclosure inside the bounds was found, and the reason."""

    box: Box
    reason: str


def cover(
    quantity: ExactQuantity,
    signals: Collection[ShiftedSignal],
    sketch: Sketch,
    start: float,
    end: float,
    reserve: float,
) -> Cover | Hole:
    """Return boxes from `start` to `end` [s] in which the quantity stays inside its bounds, both drawn in by `reserve`.

    Discs are chosen for all `signals`, also those of other quantities: so quantities share boxes, and each signal is
    enclosed once in a box.
    """
    with ball_arithmetic():
        lower, upper = arb(quantity.bounds.lower) + arb(reserve), arb(quantity.bounds.upper) - arb(reserve)
    waiting = [_box(signals, start, end)]
    proved: list[Box] = []
    while waiting:
        box = waiting.pop()
        margin = sketch.smallest(box.start, box.end) - reserve
        reason = _TOO_WIDE
        if _missed(quantity, box, sketch.steepest(box.start, box.end)) <= margin / 2:
            try:
                if enclosure(quantity, box, TERMS).stays_in(lower, upper):
                    proved.append(box)
                    done("box")
                    continue
            except UndefinedError as undefined:
                reason = str(undefined)
        middle = box.start + (box.end - box.start) / 2
        if not box.start < middle < box.end or len(waiting) + len(proved) > _MOST_BOXES:
            return Hole(box, reason)
        waiting += [_box(signals, middle, box.end), _box(signals, box.start, middle)]
    return Cover((start, *(box.end for box in proved)), tuple(box.radius for box in proved))


def _missed(quantity: ExactQuantity, box: Box, slopes: Mapping[str, float]) -> float:
    """Estimate cheaply the error of the enclosure's polynomial, to reject boxes that are much too wide."""
    missed = (float_above(remainder(functional, box, TERMS)) for functional in quantity.arguments.values())
    return sum(slope * rest for slope, rest in zip(slopes.values(), missed, strict=True))


def _box(signals: Collection[ShiftedSignal], start: float, end: float) -> Box:
    return Box(start, end, best_radius(signals, start, end, TERMS))
