"""The first pass of a check: find the boxes in which quantities certainly stay inside their bounds, in float64.

A box is an interval of time. An instant is checked as a narrow box around it.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from fractions import Fraction
from math import isfinite
from typing import Any

import numpy as np

from trackably.checker.boxes import Box, Enclosures, FirstPass, stays_inside
from trackably.checker.floats.intervals import Floats, bernstein_on_box, join, stack, stay_between, sums
from trackably.checker.floats.joints import undecided
from trackably.checker.floats.signals import Boxes, Indices, ManyCentres
from trackably.checker.intervals import Real, UndefinedError, around, between, exactly
from trackably.checker.kernels import Decay
from trackably.checker.models import Model
from trackably.checker.quantities import Quantity, Shifted, shifts_of
from trackably.checker.rounding import FormulaNeeds, FormulaValues
from trackably.checker.subject import Signal, Subject

_NO_BOX = Box(0.0, 0.0, 0.0)
_AT_ONCE, _COEFFICIENTS = 256, 2_000_000
"""Boxes and Taylor coefficients that are processed at once, to limit the memory for any file."""


def boxes_left(
    needs: FormulaNeeds, subject: Subject, terms: int, held: Mapping[Box, list[Quantity]]
) -> Iterator[tuple[Box, list[Quantity]]]:
    """Yield each box with those of its quantities that float64 does not show to stay inside their bounds.

    `held` has the quantities of each box, and `terms` is the number of Taylor coefficients.
    """
    every = {q.name: q for h in held.values() for q in h}
    wanted = {shifted for q in every.values() for shifted in _needs(q)}
    for some, known in _enclosed(subject, wanted, list(held), terms):
        start, tried = exactly(min(box.start for box in some)), dict[tuple[Box, str], tuple[bool, Floats]]()
        for q in every.values():
            with np.errstate(all="ignore"):  # results that are not finite prove nothing
                where = np.flatnonzero([any(q is each for each in held[box]) for box in some])
                where, found = _models_of(needs, subject, q, known, where, terms)
                first: Any = around(found.at(0), found.at(-1))
                near = join([first.at(None), found.at(slice(1, -1))], axis=0)
                near, low, high = bernstein_on_box(near), *(_end(limit.after(start)) for limit in (q.lower, q.upper))
                kept, ends = stay_between(near, low, high), near.at([0, -1])
                lost = ~kept & np.any((ends.high > high.low) | (ends.low < low.high), axis=0)
            promising = np.flatnonzero(~lost).tolist()
            tried |= {(some[where[i]], q.name): (bool(kept[i]), found.at((..., i))) for i in promising}
        for box in some:
            yield box, [q for q in held[box] if not _is_inside(q, box, *tried.get((box, q.name), (False, None)))]


def _is_inside(q: Quantity, box: Box, is_kept: bool, of_box: Floats | None) -> bool:
    """Return whether q is shown to stay inside its bounds in a box.

    `is_kept` says whether float64 shows it. If not, it is decided again in integers, from the model `of_box`: its
    coefficients, then the bound of its remainder. `of_box` is None if q may be undefined in the box, or if the
    enclosure of q leaves the bounds at an end of the box.
    """
    model = None if is_kept or of_box is None else _model(of_box)
    return is_kept or (model is not None and stays_inside(model, q, box))


def models(
    subject: Subject, wanted: Sequence[Shifted], boxes: Sequence[Box], terms: int
) -> Iterator[dict[Shifted, Model]]:
    """Yield for each box models of shifted signals in the arithmetic of mpmath, without those that are not finite."""
    for some, known in _enclosed(subject, wanted, boxes, terms):
        for b in range(len(some)):
            of_box = {
                shifted: _model(stack([*of.coefficients, of.missed], (len(some),)).at((..., b)))
                for shifted, of in known.items()
            }
            yield {shifted: model for shifted, model in of_box.items() if model}


def _enclosed(
    subject: Subject, wanted: Collection[Shifted], boxes: Sequence[Box], terms: int
) -> Iterator[tuple[Sequence[Box], dict[Shifted, Model]]]:
    """Yield groups of boxes with models of shifted signals without their means, as arrays with an entry for each box.

    The number of boxes in a group limits the memory for models of the `wanted` signals.
    """
    shifts = {s: [j for of, j in sorted(wanted) if of == s] for s in sorted({s for s, _ in wanted})}
    signals, step = {s: ManyCentres.of(subject.signals[s]) for s in shifts}, Fraction(subject.system.sampling_time)
    at_once = max(1, min(_AT_ONCE, _COEFFICIENTS // (terms * (len(wanted) + 1))))
    for begin in range(0, len(boxes), at_once):
        some, known = boxes[begin : begin + at_once], dict[Shifted, Model]()
        for s, of in signals.items():
            starts, ends, radii = np.tile(np.array(some).T, len(shifts[s]))  # all boxes, once for each shift
            with np.errstate(all="ignore"):
                found = of.enclose(Boxes(starts, ends, radii, [j * step for j in shifts[s] for _ in some]), terms)
            for i, j in enumerate(shifts[s]):
                known[s, j] = _at(found, slice(i * len(some), (i + 1) * len(some)))
        yield some, known


def _at(models: Any, index: slice | Indices) -> Model:
    """Return the models of some boxes; `index` selects these boxes in the last axis of the arrays."""
    return Model([c.at((..., index)) for c in models.coefficients], models.missed.at(index))


def _needs(q: Quantity) -> list[Shifted]:
    return [shifted for argument in q.arguments.values() for shifted in shifts_of(argument)]


def _models_of(
    needs: FormulaNeeds, subject: Subject, q: Quantity, known: Mapping[Shifted, Any], where: Indices, n: int
) -> tuple[Indices, Any]:
    """Return the indices, among `where`, of the B boxes in which q is certainly defined, and its models, (n + 1, B).

    The first n rows have the coefficients, and the last row the bounds of the remainders. `known` has models of shifted
    signals in all boxes, with n coefficients.
    """
    while len(where):
        enclosures = Enclosures(subject, n, _NO_BOX, {shifted: _at(known[shifted], where) for shifted in _needs(q)})
        try:
            model = FormulaValues(needs, n).enclose(q, enclosures.arguments(q))
        except UndefinedError as undefined:
            where = where[np.broadcast_to(undefined.where, where.shape)]
            continue
        return where, stack([*model.coefficients, model.missed], where.shape)
    return where, Floats.exact(np.empty((n + 1, 0)))


def _end(constant: Real | None) -> Floats:
    """Return the `constant` end of a bound; NaN, which shows nothing, if the end moves (None)."""
    return Floats.exact(np.array(np.nan)) if constant is None else Floats.of(constant)


def _model(of_box: Floats) -> Model | None:
    """Return the model of one box in the arithmetic of mpmath, from its coefficients and its bound of the remainder.

    Return None if the model is not finite.
    """
    ends = list(zip(of_box.low.tolist(), of_box.high.tolist(), strict=True))
    if not np.isfinite(ends).all():
        return None
    return Model([between(*of) for of in ends[:-1]], exactly(ends[-1][1]))


def envelope(signal: Signal, start: Real) -> Decay | None:
    """Over-estimate |z − m| and |ż| of a signal z with mean m, for all times after `start` [s]; None if not finite."""
    with np.errstate(all="ignore"):
        distance: Any = Floats.of(start) - Floats.exact(np.array(signal.centres))
        each = signal.kernel.beyond(distance.choose(distance.low >= 0, distance, 0.0))
        sizes, first = abs(Floats.exact(np.array(signal.weights))), np.zeros(1, dtype=np.intp)
        size, slope = (float(sums(sizes * part, first).high[0]) for part in each)
    return Decay(exactly(size), exactly(slope)) if isfinite(size) and isfinite(slope) else None


def keeps_subnormals() -> bool:
    """Return whether float64 arithmetic has subnormal numbers, as IEEE arithmetic has.

    A processor may be set to replace subnormal numbers by zero.
    """
    smallest_normal = np.full(8, np.finfo(np.float64).smallest_normal)
    return bool(np.all(smallest_normal / 2 * 2 == smallest_normal))


_TRUSTED = (
    "This was checked in float64 intervals first, which trusts IEEE arithmetic and NumPy's exp, log, sqrt, cos, arctan "
    "and arctan2."
)
FIRST_PASS = FirstPass(boxes_left, models, envelope, undecided, keeps_subnormals, _TRUSTED)
"""The first pass in arrays of float64 intervals."""
