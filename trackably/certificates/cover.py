"""Propose boxes of time that cover a window: the checker says in which of them bounds hold; the others are halved."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import pairwise
from typing import Any, Self

import numpy as np

from trackably.arrays import Array
from trackably.certificates.draft import TERMS, Draft, has_periodic_part
from trackably.checker.boxes import Box, Enclosures, refusals
from trackably.checker.certificate import Boxes
from trackably.checker.floats.boxes import FIRST_PASS
from trackably.checker.floats.intervals import Floats
from trackably.checker.quantities import LinearCombination, Quantity, shifts_of
from trackably.checker.rounding import FormulaNeeds
from trackably.checker.subject import Subject
from trackably.systems.reference import Reference
from trackably.systems.trajectories import Quantities
from trackably.work import done

# The search ends if more boxes are refused in a round than the first number, plus the second number for each centre.
_MOST_BOXES, _MOST_BY_CENTRE = 20_000, 8
# Most halvings of a box, and number of halvings after which the search ends if 7 of 8 boxes without kinks are refused.
_MOST_HALVINGS, _NARROW_ENOUGH = 60, 4
# From the first number of halvings on, refused boxes are checked again in mpmath if there are at most as many as the
# second number.
_EXACT_FROM, _MOST_EXACT = 12, 16
# Largest width of the first boxes near centres, in correlation times, for linear quantities and for formulas. In wider
# boxes most proofs fail, in narrower boxes hardly any.
_WIDTH, _NARROW = 2.0, 0.7
# A kink is near the middle of a box if its distance from there is less than this part of half the box's width.
_CENTRAL = 0.5
# Half the width of the box around a kink whose time is no float64 number, in spacings of float64 at this time.
_BESIDE = 2.0**16
# Radii of the discs that are tried around a box, relative to half its width.
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

    Boxes of all quantities come from the same repeated divisions, so that a signal is enclosed only once in each box.
    """
    wanted: _Wanted = dict.fromkeys(pairwise(_first_edges(draft, reference, start, end).tolist()), draft.quantities)
    kinks, accepted = _Kinks.of(draft), {q.name: list[Box]() for q in draft.quantities}
    for halvings in range(_MOST_HALVINGS):
        ends = np.array([*wanted]).T
        radii = discs(draft.subject, reference, draft.arguments, *ends)
        boxes = np.vstack([ends, radii]).T.tolist()
        tried = {Box(*box): [*of] for box, of in zip(boxes, wanted.values(), strict=True)}
        refused: _Refused = _refusals(draft, tried, exactly=False)
        if halvings >= _EXACT_FROM and 0 < len(refused) <= _MOST_EXACT and not any(map(kinks.are_in, refused)):
            left = {box: [q for q in tried[box] if q.name in names] for box, names in refused.items()}
            refused = _refusals(draft, left, exactly=True)
        for box, of in tried.items():
            for q in of:
                if q.name not in refused.get(box, ()):
                    accepted[q.name].append(box)
                    done("box")
        if not refused:
            return {name: _join(start, found) for name, found in accepted.items()}
        smooth = sum(not kinks.are_in(box) for box in tried)
        if given_up := _hopeless(draft, reference, refused, halvings, smooth, kinks):
            name, box = given_up
            reason = refused[box][name] or "no enclosure found in this box is narrow enough"
            return UncoveredBox(name, box.start, box.end, reason)
        wanted = {
            part: [q for q in draft.quantities if q.name in names]
            for box, names in refused.items()
            for part in pairwise([box.start, *kinks.cuts(box), box.end])
        }
    raise AssertionError("a box that is not proved after the last halving is given up")


_Wanted = dict[tuple[float, float], Sequence[Quantity]]
"""The quantities whose bounds are to be proved from a start to an end [s]."""

_Refused = Mapping[Box, Mapping[str, str]]
"""Boxes with the names of the quantities that are not shown to keep their bounds in them, and the reasons."""


def _hopeless(
    draft: Draft, reference: Reference, refused: _Refused, halvings: int, smooth: int, kinks: "_Kinks"
) -> tuple[str, Box] | None:
    """Return the name of a quantity and a box for which halving does not help, or would give too many boxes.

    Return None if halving may help. `smooth` is the number of tried boxes that have no kink at which to divide them.
    """
    middles = [box.start + (box.end - box.start) / 2 for box in refused]
    margins = Quantities(reference.quantities, [signal.summed for signal in reference.kernel_sums])
    at_middles = margins.margins(np.array(middles)).T.tolist()
    for (box, names), middle, of in zip(refused.items(), middles, at_middles, strict=True):
        for q, margin in zip(draft.quantities, of, strict=True):
            if q.name in names and (margin <= draft.errors[q.name] or not box.start < middle < box.end):
                return q.name, box
    # If nearly all narrow boxes without kinks are refused, rounding errors exceed the margins: halving does not help.
    in_vain = sum(not kinks.are_in(box) for box in refused)
    is_in_vain = halvings >= _NARROW_ENOUGH and in_vain > max(_MOST_EXACT, 0.875 * smooth)
    most = _MOST_BOXES + _MOST_BY_CENTRE * sum(len(signal.centres) for signal in draft.subject.signals)
    if is_in_vain or len(refused) > most or halvings == _MOST_HALVINGS - 1:
        box, names = next(iter(refused.items()))
        return next(iter(names)), box
    return None


@dataclass(frozen=True)
class _Kinks:
    """The times [s] at which signals have kinks, in increasing order, and the weights |c_i| of the kinks as `sizes`.

    Beyond a kink inside a box, a Taylor polynomial has an error that grows with the weight and the time since the kink.
    So boxes are divided at kinks; by halving alone, they would have to be very narrow. If the time of a kink is no
    float64 number, the kink gets a narrow box of its own, from `lower` to `upper`, wide enough to contain the kink near
    its middle for certain. Otherwise `lower` and `upper` are the time of the kink.
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

    def are_in(self, box: Box) -> bool:
        """Whether a kink at which the box can be divided is inside it; not if the box is a narrow one around a kink."""
        before, after = np.searchsorted(self._cuts, box.start, side="right"), np.searchsorted(self._cuts, box.end)
        return bool(before < after)

    @cached_property
    def _cuts(self) -> Array:
        return np.sort(np.concatenate([self.lower, self.upper]))

    def cuts(self, box: Box) -> list[float]:
        """Return the times [s] at which to divide a box: at the largest kink near its middle, if there is one.

        Otherwise divide it at the kink that is nearest to its middle. If no kink is inside, or the box is a narrow one
        around a kink, divide it in the middle.
        """
        start, end = box.start, box.end
        first, last = np.searchsorted(self.upper, start, side="right"), np.searchsorted(self.lower, end)
        lower, upper, sizes = (of[first:last] for of in (self.lower, self.upper, self.sizes))
        ends = set[float]()
        if len(sizes):
            off = np.abs((lower + upper) - (start + end)) / (end - start)
            at = int(np.argmax(np.where(off < _CENTRAL, sizes, -off)))
            ends = {float(lower[at]), float(upper[at])}
        return sorted(t for t in ends if start < t < end) or [start + (end - start) / 2]


def _refusals(draft: Draft, held: Mapping[Box, list[Quantity]], exactly: bool) -> dict[Box, dict[str, str]]:
    """Return the boxes in which quantities are not shown to keep their bounds, with their names and the reasons.

    `held` has the quantities to check in each box. Those that float64 intervals do not decide are refused with an empty
    reason, or, if `exactly`, checked again in mpmath, which takes long.
    """
    needs, refused = FormulaNeeds.of(draft.certificate, list(draft.quantities)), dict[Box, dict[str, str]]()
    for box, rest in FIRST_PASS.boxes(needs, draft.subject, TERMS, held):
        left = refusals(needs, Enclosures(draft.subject, TERMS, box), rest) if exactly else ((q, "") for q in rest)
        if names := {q.name: why for q, why in left}:
            refused[box] = names
    return refused


def _first_edges(draft: Draft, reference: Reference, start: float, end: float) -> Array:
    """Return the ends [s] of the boxes that are tried first, by repeated halving, with narrow boxes near centres.

    A box is not halved if no centre is closer than its width, as signals change slowly far from all centres.
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
        split = near & (widths > widest)
        if not np.any(split):
            return edges
        edges = np.sort(np.concatenate([edges, edges[:-1][split] + widths[split] / 2]))


def _shifts(subject: Subject, arguments: Iterable[LinearCombination]) -> list[tuple[int, Fraction]]:
    """Return the pairs (index s of a signal, shift j T_s [s]) that the linear combinations contain, sorted."""
    found = {shifted for argument in arguments for shifted in shifts_of(argument)}
    return [(s, j * Fraction(subject.system.sampling_time)) for s, j in sorted(found)]


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
            after = np.minimum(np.searchsorted(centres, times), len(centres) - 1)
            nearest = np.minimum(np.abs(times - centres[after]), np.abs(times - centres[np.maximum(after - 1, 0)]))
            if has_periodic_part(kernel):  # κ repeats: far from a centre, it need not be small
                nearest = np.zeros_like(nearest)
            bounds += on_disc(Floats.exact(nearest), Floats.exact(tried)).high
        sizes = bounds * (halves / tried) ** terms
    sizes[~np.isfinite(sizes)] = np.inf
    return np.asarray(tried[np.argmin(sizes, axis=0), np.arange(len(starts))])


def _join(start: float, found: Iterable[Box]) -> Boxes:
    boxes = sorted(found)
    return Boxes((start, *(box.end for box in boxes)), tuple(box.radius for box in boxes))
