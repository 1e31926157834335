"""Propose boxes that cover a window: the checker tells in which of them bounds are kept, and the others are halved."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from trackably.arrays import Array, Flags
from trackably.certificates.certificate import Cover
from trackably.certificates.draft import TERMS, Draft, has_periodic_part
from trackably.checker.boxes import Box
from trackably.checker.floats.intervals import Floats
from trackably.progress.work import done
from trackably.systems.reference import Reference
from trackably.systems.trajectories import Quantities

_MOST_BOXES, _MOST_BY_CENTRE = 20_000, 8
_MOST_HALVINGS, _NARROW_ENOUGH = 60, 4  # most halvings of a box; and the number after which most have to be accepted
_EXACT_FROM, _MOST_EXACT = 12, 16  # halvings after which the checker is asked exactly, and about how many boxes at most
_WIDTH, _NARROW = 2.0, 0.7  # correlation times: in wider boxes near a centre most proofs fail; below, hardly any
_RATIOS = np.array([1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 13.0, 16.0, 20.0, 26.0, 32.0, 64.0, 128.0])


@dataclass(frozen=True)
class UncoveredBox:
    """A box [start, end] [s] in which the checker does not accept that the quantity `name` keeps its bounds."""

    name: str
    start: float
    end: float
    reason: str


def cover(
    draft: Draft, reference: Reference, start: float, end: float, asks: bool = True
) -> dict[str, Cover] | UncoveredBox:
    """Return boxes from `start` to `end` [s] for each quantity, all accepted by the checker; or a box that it refuses.

    Quantities share boxes, and smaller boxes are parts of larger ones, so that each signal is enclosed once in a box.
    If `asks` is False, narrow boxes are proposed without asking the checker.
    """
    edges = _first_edges(draft, reference, start, end, asks)
    boxes, wanted = np.stack([edges[:-1], edges[1:]]), np.ones((len(draft.quantities), len(edges) - 1), dtype=bool)
    if not asks:
        one = _joined(start, [np.vstack([boxes, _radii(draft, reference, *boxes)])])
        return {q.name: one for q in draft.quantities}
    accepted: list[list[Array]] = [[] for _ in draft.quantities]
    for halvings in range(_MOST_HALVINGS):
        tried = np.vstack([boxes, _radii(draft, reference, *boxes)])
        missing, reasons = _refused(draft, tried, wanted, exactly=False)
        if halvings >= _EXACT_FROM and 0 < np.count_nonzero(np.any(missing, axis=0)) <= _MOST_EXACT:
            missing, reasons = _refused(draft, tried, missing, exactly=True)
        for found, kept in zip(accepted, wanted & ~missing, strict=True):
            found.append(tried[:, kept])
            for _ in range(np.count_nonzero(kept)):
                done("box")
        if not np.any(missing):
            return {q.name: _joined(start, found) for q, found in zip(draft.quantities, accepted, strict=True)}
        if (given_up := _given_up(draft, reference, boxes, missing, halvings)) is not None:
            q, b = given_up
            name, first = draft.quantities[q].name, float(boxes[0, b])
            reason = reasons.get((name, first), "") or "no enclosure found in this box is narrow enough"
            return UncoveredBox(name, first, float(boxes[1, b]), reason)
        split = np.any(missing, axis=0)
        starts, middles, ends = boxes[0, split], _middles(boxes[:, split]), boxes[1, split]
        boxes = np.stack([np.stack([starts, middles], axis=1).ravel(), np.stack([middles, ends], axis=1).ravel()])
        wanted = np.repeat(missing[:, split], 2, axis=1)
    raise AssertionError("after the last halving, it is given up")


def _given_up(
    draft: Draft, reference: Reference, boxes: Array, missing: Flags, halvings: int
) -> tuple[int, int] | None:
    """Return a quantity and a box for which halving does not help, or would give too many boxes.

    None if it may help.
    """
    count, split = boxes.shape[1], np.any(missing, axis=0)
    starts, ends = boxes
    middles, hopeless = _middles(boxes), np.zeros_like(missing)
    margins = Quantities(reference.quantities, [signal.summed for signal in reference.kernel_sums])
    errors = np.array([draft.errors[q.name] for q in draft.quantities])
    hopeless[:, split] = margins.margins(middles[split]) <= errors[:, None]
    hopeless = missing & (hopeless | ~((starts < middles) & (middles < ends)))
    # If narrow boxes are refused nearly everywhere, rounding errors exceed the margins: halving does not help.
    is_in_vain = halvings >= _NARROW_ENOUGH and split.sum() > max(_MOST_EXACT, 0.875 * count)
    most = _MOST_BOXES + _MOST_BY_CENTRE * sum(len(signal.centres) for signal in draft.subject.signals)
    if np.any(hopeless) or is_in_vain or split.sum() > most or halvings == _MOST_HALVINGS - 1:
        q, b = np.argwhere(hopeless if np.any(hopeless) else missing)[0]
        return int(q), int(b)
    return None


def _middles(boxes: Array) -> Array:
    return np.asarray(boxes[0] + (boxes[1] - boxes[0]) / 2)


def _refused(draft: Draft, boxes: Array, wanted: Flags, exactly: bool) -> tuple[Flags, dict[tuple[str, float], str]]:
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
    for box, q, why in draft.refused(held, exactly):
        missing[index[q.name], at[box]] = True
        reasons[q.name, box.start] = why
    return missing, reasons


def _first_edges(draft: Draft, reference: Reference, start: float, end: float, asks: bool) -> Array:
    """Return the ends [s] of the boxes that are tried first, by repeated halving, with narrow boxes near centres.

    A box is not halved if no centre is closer than its width, as signals change slowly far from all centres.
    """
    is_linear = all(q.combination is not None and not q.needs for q in draft.quantities)
    shortest = min(signal.kernel.correlation_time for signal in reference.kernel_sums)
    widest = (_WIDTH if is_linear and asks else _NARROW) * shortest
    shifts = sorted({float(shift) for _, shift in _shifted(draft)})
    centres = np.sort(
        np.concatenate([np.subtract.outer(signal.centres, shifts).ravel() for signal in draft.subject.signals])
    )
    edges = np.array([start, end])
    while True:
        widths = np.diff(edges)
        near = np.searchsorted(centres, edges[1:] + widths) > np.searchsorted(centres, edges[:-1] - widths)
        split = near & (widths > widest)
        if not np.any(split):
            return edges
        edges = np.sort(np.concatenate([edges, edges[:-1][split] + widths[split] / 2]))


def _shifted(draft: Draft) -> list[tuple[int, float]]:
    """Return the pairs of a signal's index s and a shift j T [s] that occur in the quantities."""
    arguments = [argument for q in draft.quantities for argument in q.arguments.values()]
    found = {
        (s, j)
        for argument in arguments
        for s, weights in enumerate(argument.weights)
        for j, w in enumerate(weights)
        if w
    }
    return [(s, j * draft.subject.system.sampling_time) for s, j in sorted(found)]


def _radii(draft: Draft, reference: Reference, starts: Array, ends: Array) -> Array:
    """Return radii [s] of discs that make the errors of Taylor polynomials small. Every radius is valid."""
    halves, middles = (ends - starts) / 2, starts + (ends - starts) / 2
    radii, bounds = halves * _RATIOS[:, None], np.zeros((len(_RATIOS), len(starts)))
    with np.errstate(all="ignore"):
        for s, shift in _shifted(draft):
            signal, kernel = draft.subject.signals[s], reference.kernel_sums[s].kernel
            on_disc: Any = signal.kernel.largest_on_disc  # of intervals of either arithmetic
            centres, times = np.sort(signal.centres), middles + shift
            after = np.minimum(np.searchsorted(centres, times), len(centres) - 1)
            nearest = np.minimum(np.abs(times - centres[after]), np.abs(times - centres[np.maximum(after - 1, 0)]))
            if has_periodic_part(kernel):  # maxima are near everywhere
                nearest = np.zeros_like(nearest)
            bounds += on_disc(Floats.exact(nearest), Floats.exact(radii)).high
        sizes = bounds * (halves / radii) ** TERMS
    best = np.argmin(np.where(np.isfinite(sizes), sizes, np.inf), axis=0)
    return np.asarray(radii[best, np.arange(len(starts))])


def _joined(start: float, found: Sequence[Array]) -> Cover:
    starts, ends, radii = np.concatenate(found, axis=1)
    order = np.argsort(starts)
    return Cover((start, *ends[order].tolist()), tuple(radii[order].tolist()))
