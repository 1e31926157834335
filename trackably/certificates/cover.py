"""Propose boxes that cover a window: the checker tells in which of them bounds are kept, and the others are halved."""

from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import Any, Self

import numpy as np

from trackably.arrays import Array, Flags
from trackably.certificates.draft import TERMS, Draft, has_periodic_part
from trackably.checker.boxes import Box
from trackably.checker.certificate import Boxes
from trackably.checker.floats.intervals import Floats
from trackably.checker.quantities import LinearCombination, Quantity
from trackably.checker.subject import Subject
from trackably.systems.reference import Reference
from trackably.systems.trajectories import Quantities
from trackably.work import done

_MOST_BOXES, _MOST_BY_CENTRE = 20_000, 8
_MOST_HALVINGS, _NARROW_ENOUGH = 60, 4  # most halvings of a box; and the number after which most have to be accepted
_EXACT_FROM, _MOST_EXACT = 12, 16  # halvings after which the checker is asked exactly, and about how many boxes at most
_WIDTH, _NARROW = 2.0, 0.7  # correlation times: in wider boxes near a centre most proofs fail; below, hardly any
_CENTRAL = 0.5  # of half a box: kinks so near to its middle divide it
_BESIDE = 2.0**16  # spacings of float64: half of a box around a kink that lies between two of them
_RATIOS = np.array([1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 13.0, 16.0, 20.0, 26.0, 32.0, 64.0, 128.0])


@dataclass(frozen=True)
class UncoveredBox:
    """A box [start, end] [s] in which the checker does not accept that the quantity `name` keeps its bounds."""

    name: str
    start: float
    end: float
    reason: str


def cover(draft: Draft, reference: Reference, start: float, end: float) -> dict[str, Boxes] | UncoveredBox:
    """Return boxes from `start` to `end` [s] for each quantity, all accepted by the checker; or a box that it refuses.

    Quantities share boxes, and smaller boxes are parts of larger ones, so that each signal is enclosed once in a box.
    """
    edges = _first_edges(draft, reference, start, end)
    boxes, wanted = np.stack([edges[:-1], edges[1:]]), np.ones((len(draft.quantities), len(edges) - 1), dtype=bool)
    kinks, accepted = _Kinks.of(draft), [dict[float, Box]() for _ in draft.quantities]
    exact = set[Box]()
    for halvings in range(_MOST_HALVINGS):
        tried = np.vstack([boxes, radii(draft.subject, reference, draft.arguments, *boxes)])
        missing, reasons = _refusals(draft, tried, wanted, exactly=False)
        refused = np.any(missing, axis=0)
        if halvings >= _EXACT_FROM and 0 < refused.sum() <= _MOST_EXACT and not kinks.are_in(boxes[:, refused]).any():
            before = missing
            missing, reasons = _refusals(draft, tried, missing, exactly=True)
            exact.update(Box(*box) for box in tried[:, np.any(before & ~missing, axis=0)].T.tolist())
        for found, kept in zip(accepted, wanted & ~missing, strict=True):
            for box in tried[:, kept].T.tolist():
                found[box[0]] = Box(*box)
                done("box")
        if np.any(missing):
            given_up = _hopeless(draft, reference, boxes, missing, halvings, ~kinks.are_in(boxes))
            if given_up is not None:
                q, b = given_up
                name, first = draft.quantities[q].name, float(boxes[0, b])
                reason = reasons.get((name, first), "") or "no enclosure found in this box is narrow enough"
                return UncoveredBox(name, first, float(boxes[1, b]), reason)
        else:
            boxes, missing = _left(draft, accepted, exact)
            if not boxes.size:
                named = zip(draft.quantities, accepted, strict=True)
                return {q.name: _join(start, found.values()) for q, found in named}
        boxes, wanted = _split(boxes, missing, kinks)
    raise AssertionError("a box that is not proved after the last halving is given up")


def _hopeless(
    draft: Draft, reference: Reference, boxes: Array, missing: Flags, halvings: int, is_smooth: Flags
) -> tuple[int, int] | None:
    """Return a quantity and a box for which halving does not help, or would give too many boxes.

    None if it may help. Boxes that are `is_smooth` hold no kink at which they can be divided.
    """
    split = np.any(missing, axis=0)
    starts, ends = boxes
    middles, hopeless = _middles(boxes), np.zeros_like(missing)
    margins = Quantities(reference.quantities, [signal.summed for signal in reference.kernel_sums])
    errors = np.array([draft.errors[q.name] for q in draft.quantities])
    hopeless[:, split] = margins.margins(middles[split]) <= errors[:, None]
    hopeless = missing & (hopeless | ~((starts < middles) & (middles < ends)))
    # If narrow boxes without kinks are refused nearly everywhere, rounding errors exceed the margins.
    refused = (split & is_smooth).sum()
    is_in_vain = halvings >= _NARROW_ENOUGH and refused > max(_MOST_EXACT, 0.875 * is_smooth.sum())
    most = _MOST_BOXES + _MOST_BY_CENTRE * sum(len(signal.centres) for signal in draft.subject.signals)
    if np.any(hopeless) or is_in_vain or split.sum() > most or halvings == _MOST_HALVINGS - 1:
        q, b = np.argwhere(hopeless if np.any(hopeless) else missing)[0]
        return int(q), int(b)
    return None


@dataclass(frozen=True)
class _Kinks:
    """Where signals have kinks [s], sorted: each is from `lower` to `upper`, its weight |c_i| is in `sizes`.

    A Taylor polynomial goes on beyond a kink, and misses what a weight times a power of the time beyond it is. Boxes
    that end at kinks miss nothing there: where kinks are, halves of boxes would have to be very narrow. A kink that is
    no float64 has a narrow box of its own, wide enough for it to be in the middle for certain.
    """

    lower: Array
    upper: Array
    sizes: Array

    @classmethod
    def of(cls, draft: Draft) -> Self:
        found = list[tuple[float, float, float]]()
        for s, shift in _shifts(draft.subject, draft.arguments):
            signal = draft.subject.signals[s]
            if not signal.kernel.has_kink:
                continue
            for centre, weight in zip(signal.centres, signal.weights, strict=True):
                exact = Fraction(centre) - shift
                near = float(exact)
                beside = _BESIDE * float(np.spacing(max(abs(centre), abs(near)))) if near != exact else 0.0
                found.append((near - beside, near + beside, abs(weight)))
        return cls(*np.array(sorted(found)).reshape(-1, 3).T)

    def inside(self, start: float, end: float) -> slice:
        """Return the slice of the kinks that lie in a box, but not at one of its ends."""
        return slice(
            int(np.searchsorted(self.upper, start, side="right")), int(np.searchsorted(self.lower, end, side="left"))
        )

    def are_in(self, boxes: Array) -> Flags:
        """Whether each of the boxes holds a kink at which it can be divided: no box within what a kink takes."""
        cuts = np.sort(np.concatenate([self.lower, self.upper]))
        before, after = np.searchsorted(cuts, boxes[0], side="right"), np.searchsorted(cuts, boxes[1], side="left")
        return np.asarray(before < after)

    def cuts(self, start: float, end: float) -> list[float]:
        """Return the times at which to divide a box: at the largest kink near its middle.

        In the middle where there is no kink, or where the box lies within what a kink takes.
        """
        of = self.inside(start, end)
        off = np.abs((self.lower[of] + self.upper[of]) - (start + end)) / (end - start)
        middle = [start + (end - start) / 2]
        if not len(off):
            return middle
        at = of.start + int(np.argmax(np.where(off < _CENTRAL, self.sizes[of], -off)))
        ends = {float(self.lower[at]), float(self.upper[at])}
        return sorted(t for t in ends if start < t < end) or middle


def _split(boxes: Array, missing: Flags, kinks: _Kinks) -> tuple[Array, Flags]:
    """Divide the boxes in which some quantity is not proved.

    Return the parts, and flags of the unproved quantities in them.
    """
    parts, wanted = list[tuple[float, float]](), list[Flags]()
    for (start, end), of in zip(boxes.T.tolist(), missing.T, strict=True):
        if of.any():
            pairs = list(pairwise([start, *kinks.cuts(start, end), end]))
            parts += pairs
            wanted += [of] * len(pairs)
    return np.array(parts).T, np.array(wanted).T


def _left(draft: Draft, accepted: list[dict[float, Box]], exact: set[Box]) -> tuple[Array, Flags]:
    """Take those boxes away that float64 intervals do not accept when all are checked together, unless `exact`.

    Return them (2, B) with what is missing in them (Q, B). Sums over centres are rounded in an order that depends on
    the boxes that are enclosed together: a box that was accepted by a hair may be refused in the whole proof. Each
    would be enclosed exactly there, which takes longer than all the others.
    """
    held = dict[Box, list[Quantity]]()
    for q, boxes in zip(draft.quantities, accepted, strict=True):
        for start in sorted(boxes):
            held.setdefault(boxes[start], []).append(q)
    names = [q.name for q in draft.quantities]
    missing = dict[tuple[float, float], Flags]()
    for box, q, _ in draft.refusals(held, exactly=False):
        if box not in exact:
            del accepted[names.index(q.name)][box.start]
            missing.setdefault(box[:2], np.zeros(len(names), dtype=bool))[names.index(q.name)] = True
    return np.array([*missing]).reshape(-1, 2).T, np.array([*missing.values()]).reshape(-1, len(names)).T


def _middles(boxes: Array) -> Array:
    return np.asarray(boxes[0] + (boxes[1] - boxes[0]) / 2)


def _refusals(draft: Draft, boxes: Array, wanted: Flags, exactly: bool) -> tuple[Flags, dict[tuple[str, float], str]]:
    """Return which `wanted` quantities are refused in which boxes (3, B), shape (Q, B), and the reasons."""
    index = {q.name: i for i, q in enumerate(draft.quantities)}
    every = [Box(*of) for of in boxes.T.tolist()]
    held = {
        box: [q for q, is_wanted in zip(draft.quantities, of, strict=True) if is_wanted]
        for box, of in zip(every, wanted.T, strict=True)
        if of.any()
    }
    at = {box: b for b, box in enumerate(every)}
    missing, reasons = np.zeros_like(wanted), dict[tuple[str, float], str]()
    for box, q, why in draft.refusals(held, exactly):
        missing[index[q.name], at[box]] = True
        reasons[q.name, box.start] = why
    return missing, reasons


def _first_edges(draft: Draft, reference: Reference, start: float, end: float) -> Array:
    """Return the ends [s] of the boxes that are tried first, by repeated halving, with narrow boxes near centres.

    A box is not halved if no centre is closer than its width, as signals change slowly far from all centres. A box
    near a centre is also halved while every disc around it holds a singularity of a kernel, as of a rational quadratic.
    """
    is_linear = all(q.combination is not None and not q.needs for q in draft.quantities)
    shortest = min(signal.kernel.correlation_time for signal in reference.kernel_sums)
    widest = (_WIDTH if is_linear else _NARROW) * shortest
    shifts = sorted({float(shift) for _, shift in _shifts(draft.subject, draft.arguments)})
    centres = np.sort(
        np.concatenate([np.subtract.outer(signal.centres, shifts).ravel() for signal in draft.subject.signals])
    )
    edges = np.array([start, *Quantities(reference.quantities, ()).breakpoints_in(start, end), end])
    while True:
        widths = np.diff(edges)
        near = np.searchsorted(centres, edges[1:] + widths) > np.searchsorted(centres, edges[:-1] - widths)
        _, sizes = _on_discs(draft.subject, reference, draft.arguments, edges[:-1], edges[1:], TERMS)
        split = near & ((widths > widest) | ~np.isfinite(sizes).any(axis=0))
        if not np.any(split):
            return edges
        edges = np.sort(np.concatenate([edges, edges[:-1][split] + widths[split] / 2]))


def _shifts(subject: Subject, arguments: Iterable[LinearCombination]) -> list[tuple[int, Fraction]]:
    """Return the pairs of a signal's index s and a shift j T [s] that occur in linear combinations."""
    found = {
        (s, j)
        for argument in arguments
        for s, weights in enumerate(argument.weights)
        for j, w in enumerate(weights)
        if w
    }
    return [(s, j * Fraction(subject.system.sampling_time)) for s, j in sorted(found)]


def radii(
    subject: Subject,
    reference: Reference,
    arguments: Iterable[LinearCombination],
    starts: Array,
    ends: Array,
    terms: int = TERMS,
) -> Array:
    """Return radii [s] of discs that make the errors of Taylor polynomials small. Every radius is valid."""
    tried, sizes = _on_discs(subject, reference, arguments, starts, ends, terms)
    return np.asarray(tried[np.argmin(sizes, axis=0), np.arange(len(starts))])


def _on_discs(
    subject: Subject, reference: Reference, arguments: Iterable[LinearCombination], starts: Array, ends: Array, n: int
) -> tuple[Array, Array]:
    """Return radii [s] of discs around boxes, and sizes of the errors of n terms on them, infinite if singular."""
    halves, middles = (ends - starts) / 2, starts + (ends - starts) / 2
    tried, bounds = halves * _RATIOS[:, None], np.zeros((len(_RATIOS), len(starts)))
    with np.errstate(all="ignore"):
        for s, shift in _shifts(subject, arguments):
            signal, kernel = subject.signals[s], reference.kernel_sums[s].kernel
            on_disc: Any = signal.kernel.largest_on_disc  # of intervals of either arithmetic
            centres, times = np.sort(signal.centres), middles + float(shift)
            after = np.minimum(np.searchsorted(centres, times), len(centres) - 1)
            nearest = np.minimum(np.abs(times - centres[after]), np.abs(times - centres[np.maximum(after - 1, 0)]))
            if has_periodic_part(kernel):  # maxima are near everywhere
                nearest = np.zeros_like(nearest)
            bounds += on_disc(Floats.exact(nearest), Floats.exact(tried)).high
        sizes = bounds * (halves / tried) ** n
    return tried, np.where(np.isfinite(sizes), sizes, np.inf)


def _join(start: float, found: Iterable[Box]) -> Boxes:
    boxes = sorted(found)
    return Boxes((start, *(box.end for box in boxes)), tuple(box.radius for box in boxes))
