"""Cover a window with boxes of time: in each box enclosures of the quantities lie inside their bounds."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from trackable.arrays import Array
from trackable.certificates.boxes.boxes import Boxes
from trackable.certificates.boxes.choice import Choice
from trackable.certificates.boxes.decision import Bounded, Decision, decide
from trackable.certificates.boxes.enclosures import Enclosures
from trackable.certificates.boxes.together import Group, Together
from trackable.certificates.enclosure import Box
from trackable.certificates.exact import ExactQuantity
from trackable.certificates.floats.balls import Mask
from trackable.progress.work import done

TERMS = 16
_MOST_BOXES, _MOST_BY_CENTRE = 20_000, 8
_HOPELESS = 2.5  # correlation times: in a wider box with a centre, Taylor polynomials err by more than the signal
_TOO_WIDE = "no enclosure found in this box is narrow enough"


@dataclass(frozen=True)
class Cover:
    """Boxes [ends_k, ends_(k+1)] without gaps, with one of the `radii` each. Times [s] are exact float64 numbers."""

    ends: tuple[float, ...]
    radii: tuple[float, ...]


@dataclass(frozen=True)
class Hole:
    """A box in which no enclosure of the quantity inside its bounds was found, and the reason."""

    quantity: ExactQuantity
    box: Box
    reason: str


def covers(quantities: Sequence[Bounded], start: float, end: float) -> list[Cover] | Hole:
    """Return boxes from `start` to `end` [s] for each quantity: in each of them it stays inside its drawn in bounds.

    All quantities are proved together, and boxes are parts of one another: so each signal is enclosed once in a box,
    here and by whoever checks the boxes.
    """
    together = Together.of([bounded.quantity for bounded in quantities])
    choice = Choice(together.groups, TERMS)
    most = _MOST_BOXES + _MOST_BY_CENTRE * max((len(each.summands.centres) for each in together.groups), default=0)
    edges = _first_edges(together.groups, start, end)
    waiting = _Waiting(edges[:-1], edges[1:], np.ones((len(quantities), len(edges) - 1), dtype=bool))
    proved: list[list[Boxes]] = [[] for _ in quantities]
    while waiting.starts.size:
        boxes = choice.boxes(waiting.starts, waiting.ends)
        enclosures, missing = Enclosures(boxes, TERMS, together), waiting.wanted.copy()
        with np.errstate(all="ignore"):  # what is not finite is not proved
            decisions = decide(quantities, enclosures, waiting.wanted)
        for q, (bounded, decision) in enumerate(zip(quantities, decisions, strict=True)):
            missing[q] &= ~decision.inside
            proved[q].append(boxes.at(decision.inside))
            for _ in range(len(proved[q][-1])):
                done("box")
            hole = _hole(bounded, boxes, missing[q], decision, len(boxes) > most)
            if hole is not None:
                return hole
        waiting = _halves(boxes, missing)
    return [_joined(start, boxes) for boxes in proved]


def _first_edges(groups: Sequence[Group], start: float, end: float) -> Array:
    """Return the ends of the boxes [s] that are tried first: halves of halves, as far as trying them would be in vain.

    Boxes without a centre are not halved, however wide they are: far from all centres little happens.
    """
    edges = np.array([start, end])
    widest = _HOPELESS * min(each.signal.kernel.correlation_time for each in groups)
    centres = np.sort(
        np.concatenate([np.subtract.outer(each.summands.centres, each.shifts.high).ravel() for each in groups])
    )
    while True:
        inside = np.diff(np.searchsorted(centres, edges)) > 0
        split = inside & (np.diff(edges) > widest)
        if not np.any(split):
            return edges
        starts, ends = edges[:-1][split], edges[1:][split]
        edges = np.sort(np.concatenate([edges, starts + (ends - starts) / 2]))


def _hole(bounded: Bounded, boxes: Boxes, missing: Mask, decision: Decision, is_last: bool) -> Hole | None:
    """Return a box that cannot be split, or in whose middle the bound is not kept; any one where this try `is_last`."""
    hopeless = missing & (is_last | ~boxes.can_be_split | decision.outside)
    if not np.any(hopeless):
        return None
    b = int(np.argmax(hopeless))
    return Hole(bounded.quantity, boxes.box(b), decision.reasons.get(b, _TOO_WIDE))


class _Waiting(NamedTuple):
    """Boxes that wait for a proof: `wanted` has shape (Q, B)."""

    starts: Array
    ends: Array
    wanted: Mask


def _halves(boxes: Boxes, missing: Mask) -> _Waiting:
    """Return the halves of all boxes in which some quantity is not proved."""
    wanted = np.any(missing, axis=0)
    starts, ends = boxes.starts[wanted], boxes.ends[wanted]
    middles = starts + (ends - starts) / 2
    both = np.repeat(missing[:, wanted], 2, axis=1)
    return _Waiting(np.stack([starts, middles], axis=1).ravel(), np.stack([middles, ends], axis=1).ravel(), both)


def _joined(start: float, found: list[Boxes]) -> Cover:
    starts, ends, radii = (
        np.concatenate(parts) for parts in zip(*((b.starts, b.ends, b.radii) for b in found), strict=True)
    )
    order = np.argsort(starts)
    return Cover((start, *ends[order].tolist()), tuple(radii[order].tolist()))
