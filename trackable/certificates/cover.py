"""Cover a window with boxes of time: in each box enclosures of the quantities lie inside their bounds."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np

from trackable.arrays import Array
from trackable.certificates.boxes.boxes import Boxes
from trackable.certificates.boxes.choice import Choice
from trackable.certificates.boxes.decision import Bounded, Decision, Limited, are_inside, decide, worth_trying
from trackable.certificates.boxes.enclosures import Enclosures
from trackable.certificates.boxes.nearby import FEW
from trackable.certificates.boxes.together import Group, Together
from trackable.certificates.enclosure import Box
from trackable.certificates.exact import ExactQuantity
from trackable.certificates.floats.balls import Mask
from trackable.progress.work import done

TERMS = 16
_MOST_BOXES, _MOST_BY_CENTRE = 20_000, 8
_GENERATIONS = 3  # of halves that are looked at together where they are few: that takes hardly longer than one
_HOPELESS = 2.5  # correlation times: in a wider box with a centre, Taylor polynomials err by more than the signal
_LIKELY, _TRIES = 1.0, 3  # correlation times: in narrower boxes most proofs succeed; and halvings of the other boxes
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
    most = _MOST_BOXES + _MOST_BY_CENTRE * max((len(each.summands.centres) for each in together.groups), default=0)
    edges = _first_edges(together.groups, start, end, _HOPELESS)
    waiting = _Waiting(edges[:-1], edges[1:], np.ones((len(quantities), len(edges) - 1), dtype=bool))
    proved: list[list[Boxes]] = [[] for _ in quantities]
    while waiting.starts.size:
        narrow = _narrow_enough(quantities, together, waiting, most)
        if isinstance(narrow, Hole):
            return narrow
        boxes, tried = narrow.enclosures.boxes, narrow.tried
        with np.errstate(all="ignore"):  # what is not finite is not proved
            decisions = decide(quantities, narrow.enclosures, tried)
        missing = tried & ~np.stack([decision.inside for decision in decisions])
        for found, decision in zip(proved, decisions, strict=True):
            found.append(boxes.at(decision.inside))
            for _ in range(len(found[-1])):
                done("box")
        if hole := _hole(quantities, boxes, missing, decisions, len(boxes) > most):
            return hole
        waiting = _halves(boxes.starts, boxes.ends, missing)
    return [_joined(start, boxes) for boxes in proved]


def covers_at_once(quantities: Sequence[Limited], start: float, end: float) -> list[Cover] | None:
    """Return the same as `covers`, by narrow boxes that are all tried; None where some of them prove nothing.

    Nobody looks first where bounds may be broken and which boxes are worth trying. That is faster where a reference is
    much like one that has been proved: a sum of analytic kernels, all of whose quantities are functionals.
    """
    together = Together.of([limited.quantity for limited in quantities])
    smooth = all(each.signal.kernel.is_analytic for each in together.groups)
    if not (smooth and all(limited.is_linear for limited in quantities)):
        return None
    choice, proved = Choice(together.groups, TERMS), [list[Boxes]() for _ in quantities]
    edges = _first_edges(together.groups, start, end, _LIKELY, 1.0)
    waiting = _Waiting(edges[:-1], edges[1:], np.ones((len(quantities), len(edges) - 1), dtype=bool))
    for _ in range(_TRIES):
        boxes = choice.boxes(waiting.starts, waiting.ends)
        with np.errstate(all="ignore"):  # what is not finite is not proved
            inside = are_inside(quantities, Enclosures(boxes, TERMS, together), waiting.wanted)
        for found, of_quantity in zip(proved, inside, strict=True):
            found.append(boxes.at(of_quantity))
        waiting = _halves(boxes.starts, boxes.ends, waiting.wanted & ~inside)
        if not waiting.starts.size:
            return [_joined(start, found) for found in proved]
    return None


class _Tried(NamedTuple):
    """Boxes that are `tried` for each quantity: shape (Q, B)."""

    enclosures: Enclosures
    tried: Mask

    @classmethod
    def joined(cls, parts: "Sequence[_Tried]") -> Self:
        """Join what is tried for any quantity."""
        some = [(each, np.any(each.tried, axis=0)) for each in parts]
        enclosures = Enclosures.joined([each.enclosures.at(wanted) for each, wanted in some])
        return cls(enclosures, np.concatenate([each.tried[:, wanted] for each, wanted in some], axis=1))


def _narrow_enough(quantities: Sequence[Bounded], together: Together, waiting: "_Waiting", most: int) -> _Tried | Hole:
    """Return boxes that are worth trying: those that wait, or halves of halves of them."""
    choice, found = Choice(together.groups, TERMS), list[_Tried]()
    while waiting.starts.size:
        first = len(waiting.starts)
        family = waiting.with_halves(FEW // together.pairs_in_a_box)
        boxes, wanted = choice.boxes(family.starts, family.ends), family.wanted
        enclosures = Enclosures(boxes, TERMS, together)
        with np.errstate(all="ignore"):
            tried = worth_trying(quantities, enclosures, wanted)
        # Halves are wanted where boxes are rejected.
        generation = slice(0, first)
        while generation.stop < len(boxes):
            halves = slice(first + 2 * generation.start, first + 2 * generation.stop)
            wanted[:, halves] = np.repeat(wanted[:, generation] & ~tried[:, generation], 2, axis=1)
            generation = halves
        tried &= wanted
        rejected = wanted & ~tried
        if hole := _hole(quantities, boxes, rejected, (), len(boxes) > most):
            return hole
        found.append(_Tried(enclosures, tried))
        waiting = _halves(boxes.starts[generation], boxes.ends[generation], rejected[:, generation])
    return _Tried.joined(found)


def _first_edges(groups: Sequence[Group], start: float, end: float, width: float, apart: float = 0.0) -> Array:
    """Return the ends of the boxes [s] that are tried first: halves of halves, of at most this `width`.

    The width is in correlation times. Boxes with no centre less than `apart` times their width away are not halved,
    however wide they are: far from all centres little happens.
    """
    edges = np.array([start, end])
    widest = width * min(each.signal.kernel.correlation_time for each in groups)
    centres = np.sort(
        np.concatenate([np.subtract.outer(each.summands.centres, each.shifts.high).ravel() for each in groups])
    )
    while True:
        widths = np.diff(edges)
        near = np.searchsorted(centres, edges[1:] + apart * widths) > np.searchsorted(
            centres, edges[:-1] - apart * widths
        )
        split = near & (widths > widest)
        if not np.any(split):
            return edges
        edges = np.sort(np.concatenate([edges, edges[:-1][split] + widths[split] / 2]))


def _hole(
    quantities: Sequence[Bounded], boxes: Boxes, missing: Mask, decisions: Sequence[Decision], is_last: bool
) -> Hole | None:
    """Return a box that cannot be split, or in whose middle the bound is not kept; any one where this try `is_last`."""
    hopeless = missing & (is_last | ~boxes.can_be_split)
    for q, decision in enumerate(decisions):
        hopeless[q] |= missing[q] & decision.outside
    if not np.any(hopeless):
        return None
    q, b = (int(i[0]) for i in np.nonzero(hopeless))
    reason = decisions[q].reasons.get(b, _TOO_WIDE) if decisions else _TOO_WIDE
    return Hole(quantities[q].quantity, boxes.box(b), reason)


class _Waiting(NamedTuple):
    """Boxes that wait for a proof: `wanted` has shape (Q, B)."""

    starts: Array
    ends: Array
    wanted: Mask

    def with_halves(self, most: int) -> "_Waiting":
        """Return these boxes, then their halves, then the halves of these: generations of at most so many boxes."""
        every = [self]
        while len(every) < _GENERATIONS and (2 ** (len(every) + 1) - 1) * len(self.starts) <= most:
            every.append(_halves(*every[-1]))
        starts, ends, wanted = zip(*every, strict=True)
        return _Waiting(np.concatenate(starts), np.concatenate(ends), np.concatenate(wanted, axis=1))


def _halves(starts: Array, ends: Array, missing: Mask) -> _Waiting:
    """Return the halves of all boxes in which some quantity is not proved."""
    wanted = np.any(missing, axis=0)
    starts, ends = starts[wanted], ends[wanted]
    middles = starts + (ends - starts) / 2
    both = np.repeat(missing[:, wanted], 2, axis=1)
    return _Waiting(np.stack([starts, middles], axis=1).ravel(), np.stack([middles, ends], axis=1).ravel(), both)


def _joined(start: float, found: Sequence[Boxes]) -> Cover:
    boxes = Boxes.joined(found)
    order = np.argsort(boxes.starts)
    return Cover((start, *boxes.ends[order].tolist()), tuple(boxes.radii[order].tolist()))
