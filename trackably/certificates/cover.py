"""Propose boxes of time that cover a window: the checker says in which of them bounds hold; the others are halved."""

from collections.abc import Callable, Iterable, Mapping
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np

from trackably.arrays import Array
from trackably.certificates.draft import TERMS, Draft, has_periodic_part
from trackably.certificates.outcome import Counterexample, Unproved
from trackably.checker.boxes import Box, Enclosures, refusals
from trackably.checker.certificate import Boxes
from trackably.checker.floats.boxes import FIRST_PASS
from trackably.checker.floats.intervals import Floats
from trackably.checker.kernels import Matern
from trackably.checker.quantities import LinearCombination, Quantity, shifts_of
from trackably.checker.rounding import FormulaNeeds
from trackably.checker.subject import Subject
from trackably.systems.pieces import two_sum
from trackably.systems.reference import Reference
from trackably.systems.trajectories import Quantities
from trackably.systems.trajectories import Quantity as Bounded
from trackably.work import done

# The search ends if more boxes are refused in a round than the first number, plus the second number for each centre and
# for each correlation time of the window, as signals with a periodic part change far from all centres, too; of these
# times, the third number count at most. It also ends after the last number of halvings.
_MOST_BOXES, _MOST_FOR_EACH, _MOST_TIMES, _MOST_HALVINGS = 2_000, 8, 2_500, 30
# From the first number of halvings on, refused boxes are checked again in mpmath if there are at most as many as the
# second number; in a window shorter than the third, in correlation times, at once: what float64 does not decide there,
# it decides in no part of it.
_EXACT_FROM, _MOST_EXACT, _INSTANT = 12, 16, 1e-4
# Largest width of the first boxes near centres, in correlation times: for linear quantities, for formulas, and for
# signals with Matérn kernels. In wider boxes most proofs fail, in narrower boxes hardly any.
_WIDTH, _NARROW, _ROUGH = 2.0, 0.7, 0.25
# Half the width of the box around a kink whose time is no float64 number, in spacings of float64 at this time.
_BESIDE = 2.0**16
# Radii of the discs that are tried around a box, relative to half its width.
_RATIOS = np.array([1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 13.0, 16.0, 20.0, 26.0, 32.0, 64.0, 128.0])


def cover(
    draft: Draft,
    start: float,
    end: float,
    failure_at: Callable[[Bounded, float], Counterexample | Unproved | None],
) -> dict[str, Boxes] | Counterexample | Unproved:
    """Return boxes from `start` to `end` [s] for each quantity, all accepted by the checker; or how one of them fails.

    Boxes of all quantities come from the same repeated divisions, so that a signal is enclosed only once in each box.
    `failure_at` returns how a quantity fails at a time [s], and None if it keeps its bounds there. It is called for the
    undecided box with the smallest margin: if the margin is smaller than the stated error, no smaller box around this
    time can be accepted.
    """
    reference = draft.reference
    shortest = min(signal.kernel.correlation_time for signal in reference.kernel_sums)
    first = pairwise(_first_edges(draft, start, end, shortest).tolist())
    wanted = {ends: [*draft.quantities] for ends in first}
    kinks, accepted = _kinks(draft), {q.name: list[Box]() for q in draft.quantities}
    needs = FormulaNeeds.of(draft.certificate, list(draft.quantities))
    exact_from = _EXACT_FROM if end - start > _INSTANT * shortest else 0
    changes = sum(
        len(of.centres) + min((end - start) / of.kernel.correlation_time, _MOST_TIMES) for of in reference.kernel_sums
    )
    for halvings in range(_MOST_HALVINGS):
        ends = np.array([*wanted]).T
        boxes = np.vstack([ends, discs(draft.subject, reference, draft.arguments, *ends)]).T.tolist()
        held = {Box(*box): of for box, of in zip(boxes, wanted.values(), strict=True)}
        undecided = dict[Box, list[Quantity]]()
        for box, left in FIRST_PASS.boxes(needs, draft.subject, TERMS, held):
            done("part")
            if left:
                undecided[box] = left
        if (tightest := _tightest(draft, undecided)) and (failure := failure_at(*tightest)):
            return failure
        refused = _refusals(draft, needs, undecided, halvings >= exact_from)
        for box, of in held.items():
            for q in of:
                if q.name not in refused.get(box, ()):
                    accepted[q.name].append(box)
                    done("box")
        if not refused:
            return {name: _join(start, found) for name, found in accepted.items()}
        every = [(why, name, box) for box, of in refused.items() for name, why in of.items()]
        reason, name, box = max(every, key=lambda found: bool(found[0]))
        if reason or len(refused) > _MOST_BOXES + _MOST_FOR_EACH * changes or halvings == _MOST_HALVINGS - 1:
            quantity, reason = reference.quantity(name), reason or "no enclosure found in this box is narrow enough"
            bounds = quantity.bounds.at(box.start)
            return failure_at(quantity, _middle(box)) or Unproved(name, bounds, (box.start, box.end), 0.0, reason)
        wanted = {
            part: [q for q in held[box] if q.name in names]
            for box, names in refused.items()
            for part in _divided(box, kinks)
        }
    raise AssertionError("a box that is not proved after the last halving is given up")


def _refusals(
    draft: Draft, needs: FormulaNeeds, undecided: Mapping[Box, list[Quantity]], exactly: bool
) -> dict[Box, dict[str, str]]:
    """Return the boxes in which quantities are not shown to keep their bounds, with their names and the reasons.

    The quantities that float64 intervals leave `undecided` in a box are refused with an empty reason, or, if `exactly`
    and if their boxes are few, checked again in mpmath, which takes long. Then the reason says why a quantity may be
    undefined in the box.
    """
    if not exactly or len(undecided) > _MOST_EXACT:
        return {box: {q.name: "" for q in left} for box, left in undecided.items()}
    again = {
        box: {q.name: why for q, why in refusals(needs, Enclosures(draft.subject, TERMS, box), left)}
        for box, left in undecided.items()
    }
    return {box: names for box, names in again.items() if names}


def _tightest(draft: Draft, undecided: Iterable[Box]) -> tuple[Bounded, float] | None:
    """Return a quantity and the middle [s] of one of the boxes where float64 shows a margin below the stated error.

    Return None if there is no such box. Of several, choose the one with the smallest difference of margin and error.
    """
    times = np.array([*map(_middle, undecided)])
    if not len(times):
        return None
    left = draft.margins(times)
    q, i = np.unravel_index(np.argmin(left), left.shape)
    return (draft.reference.quantities[q], float(times[i])) if left[q, i] < 0 else None


def _kinks(draft: Draft) -> Array:
    """Return the times [s] at which boxes are divided because signals have kinks there, in increasing order.

    Beyond a kink inside a box, a Taylor polynomial has an error that grows with the weight and the time since the kink.
    If the time of a kink is no float64 number, it gets a narrow box of its own, wide enough to contain the kink near
    its middle for certain.
    """
    found: list[Array] = []
    for s, shift in _shifts(draft.subject, draft.arguments):
        if (signal := draft.subject.signals[s]).kernel.has_kink:
            centres = np.array(signal.centres)
            near, lost = two_sum(centres, np.full(len(centres), -float(shift)))
            is_exact = (lost == 0.0) & (float(shift) == shift)
            beside = np.where(is_exact, 0.0, _BESIDE * np.spacing(np.maximum(np.abs(near), np.abs(centres))))
            found += [near - beside, near + beside]
    return np.unique(np.concatenate(found)) if found else np.empty(0)


def _divided(box: Box, kinks: Array) -> Iterable[tuple[float, float]]:
    """Return the two parts of a box, each as (start, end) [s].

    The box is divided at the kink inside that is nearest to its middle; without a kink inside, at its middle.
    """
    middle = _middle(box)
    inside = kinks[np.searchsorted(kinks, box.start, side="right") : np.searchsorted(kinks, box.end)].tolist()
    return pairwise(sorted({box.start, min(inside, key=lambda t: abs(t - middle), default=middle), box.end}))


def _first_edges(draft: Draft, start: float, end: float, shortest: float) -> Array:
    """Return the ends [s] of the boxes that are tried first, by repeated halving, with narrow boxes near centres.

    A box is not halved if no centre is closer than its width, as signals change slowly far from all centres. `shortest`
    [s] is the least correlation time of the kernels.
    """
    is_rough = any(isinstance(signal.kernel, Matern) for signal in draft.subject.signals)
    widest = (_ROUGH if is_rough else _WIDTH if draft.is_linear else _NARROW) * shortest
    shifts = sorted({float(shift) for _, shift in _shifts(draft.subject, draft.arguments)})
    centres = np.sort(
        np.concatenate([np.subtract.outer(signal.centres, shifts).ravel() for signal in draft.subject.signals])
    )
    edges = np.array([start, *Quantities(draft.reference.quantities, ()).breakpoints_in(start, end), end])
    while True:
        widths = np.diff(edges)
        near = np.searchsorted(centres, edges[1:] + widths) > np.searchsorted(centres, edges[:-1] - widths)
        split = near & (widths > widest)
        if not np.any(split):
            return edges
        edges = np.sort(np.concatenate([edges, edges[:-1][split] + widths[split] / 2]))


def _shifts(subject: Subject, arguments: Iterable[LinearCombination]) -> list[tuple[int, Fraction]]:
    """Return the pairs (index s of a signal, shift j T_s [s]) that the linear combinations contain, sorted."""
    found = {shifted for argument in arguments for shifted in shifts_of(argument)}
    return [(s, j * Fraction(subject.system.sampling_time)) for s, j in sorted(found)]


def _middle(box: Box) -> float:
    return box.start + (box.end - box.start) / 2


def discs(
    subject: Subject,
    reference: Reference,
    arguments: Iterable[LinearCombination],
    starts: Array,
    ends: Array,
    terms: int = TERMS,
) -> Array:
    """Return the radius [s] of a complex disc around each box, in which the Taylor polynomial's error is estimated.

    Of some radii, the one with the smallest error by Cauchy's estimate is chosen, for polynomials with `terms` terms.
    Every radius is valid; some only lead to large errors.
    """
    halves, middles = (ends - starts) / 2, starts + (ends - starts) / 2
    tried, bounds = halves * _RATIOS[:, None], np.zeros((len(_RATIOS), len(starts)))
    with np.errstate(all="ignore"):
        for s, shift in _shifts(subject, arguments):
            signal, kernel = subject.signals[s], reference.kernel_sums[s].kernel
            on_disc: Any = signal.kernel.largest_on_disc  # takes intervals of mpmath, and arrays of intervals
            centres, times = np.sort(signal.centres), middles + float(shift)
            nearest = np.abs(times - centres[np.searchsorted((centres[:-1] + centres[1:]) / 2, times)])
            if has_periodic_part(kernel):  # κ repeats: far from a centre, it need not be small
                nearest = 0.0 * nearest
            bounds += on_disc(Floats.exact(nearest), Floats.exact(tried)).high
        sizes = bounds * (halves / tried) ** terms
    sizes[~np.isfinite(sizes)] = np.inf
    return np.asarray(tried[np.argmin(sizes, axis=0), np.arange(len(starts))])


def _join(start: float, found: Iterable[Box]) -> Boxes:
    boxes = sorted(found)
    return Boxes((start, *(box.end for box in boxes)), tuple(box.radius for box in boxes))
