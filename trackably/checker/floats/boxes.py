"""The first pass of a check: find the boxes in which quantities certainly stay inside their bounds, in float64.

A box is an interval of time. An instant is checked as a narrow box around it.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from fractions import Fraction
from math import isfinite
from typing import Any

import numpy as np

from trackably.checker.boxes import Box, Enclosures, FirstPass, stays_inside
from trackably.checker.floats.intervals import Floats, Mask, bernstein_on_box, join, stack, stay_between, sums
from trackably.checker.floats.joints import undecided
from trackably.checker.floats.signals import Boxes, Indices, ManyCentres
from trackably.checker.formulas import parts
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
    formulas = {f for q in every.values() for f in (*(f for _, f in q.parts), *(need.formula for need in q.needs))}
    wanted = {shifted for q in every.values() for shifted in _needs(q)}
    beside = len(every) + sum(len(parts(formula)) for formula in formulas)
    for some, known in _enclosed(subject, wanted, list(held), terms, beside):
        start, tried, rows = exactly(min(box.start for box in some)), list[tuple[Box, Quantity]](), []
        with np.errstate(all="ignore"):  # results that are not finite prove nothing
            for q in every.values():
                where = np.flatnonzero([any(q is each for each in held[box]) for box in some])
                where, found = _models_of(needs, subject, q, known, where, terms)
                tried += [(some[b], q) for b in where.tolist()]
                rows.append((found, *(_end(limit.after(start), len(where)) for limit in (q.lower, q.upper))))
            found, low, high = (join(each) for each in zip(*rows, strict=True))
            every_row: Any = [found.at(k) for k in range(terms + 1)]
            first, *others, missed = every_row
            near = join([c.at(None) for c in (around(first, missed), *others)], axis=0)
            kept = stay_between(bernstein_on_box(near), low, high)
        found_at = {(box, q.name): i for i, (box, q) in enumerate(tried)}
        yield from _left(held, some, found_at, kept, Model([first, *others], missed))


def _left(
    held: Mapping[Box, list[Quantity]],
    boxes: Sequence[Box],
    found_at: Mapping[tuple[Box, str], int],
    kept: Mask,
    models: Model,
) -> Iterator[tuple[Box, list[Quantity]]]:
    """Yield boxes with the quantities that are left to be proved.

    `found_at` has, for a box and a quantity's name, the index i of the quantity in kept[i] and in the arrays of
    `models`; it has none if the quantity may be undefined in the box. A quantity that is not `kept` inside its bounds
    is tried again in integers.
    """
    for box in boxes:
        left = []
        for q in held[box]:
            i = found_at.get((box, q.name))
            of_box = None if i is None or kept[i] else _model(models, i)
            if i is None or not (kept[i] or (of_box and stays_inside(of_box, q, box))):
                left.append(q)
        yield box, left


def models(
    subject: Subject, wanted: Sequence[Shifted], boxes: Sequence[Box], terms: int
) -> Iterator[dict[Shifted, Model]]:
    """Yield for each box models of shifted signals in the arithmetic of mpmath, without those that are not finite."""
    for some, known in _enclosed(subject, wanted, boxes, terms):
        for b in range(len(some)):
            of_box = {shifted: _model(of, b) for shifted, of in known.items()}
            yield {shifted: model for shifted, model in of_box.items() if model}


def _enclosed(
    subject: Subject, wanted: Collection[Shifted], boxes: Sequence[Box], terms: int, others: int = 0
) -> Iterator[tuple[Sequence[Box], dict[Shifted, Model]]]:
    """Yield groups of boxes with models of shifted signals without their means, as arrays with an entry for each box.

    The number of boxes in a group limits the memory, if a box takes a model of each of the `wanted` signals, and
    `others` further models.
    """
    signals, step = {s: ManyCentres.of(subject.signals[s]) for s, _ in wanted}, Fraction(subject.system.sampling_time)
    at_once = max(1, min(_AT_ONCE, _COEFFICIENTS // (terms * (len(wanted) + 1 + others))))
    for begin in range(0, len(boxes), at_once):
        some = boxes[begin : begin + at_once]
        with np.errstate(all="ignore"):
            known = {(s, j): signals[s].enclose(Boxes(*np.array(some).T, j * step), terms) for s, j in wanted}
        yield some, known


def _at(models: Any, where: Indices) -> Model:
    """Return the models of some boxes."""
    return Model([c.at(where) for c in models.coefficients], models.missed.at(where))


def _needs(q: Quantity) -> list[Shifted]:
    return [shifted for argument in q.arguments.values() for shifted in shifts_of(argument)]


def _models_of(
    needs: FormulaNeeds, subject: Subject, q: Quantity, known: Mapping[Shifted, Any], where: Indices, n: int
) -> tuple[Indices, Floats]:
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
        none = Floats.exact(np.zeros((1, len(where))))
        return where, join([none + c for c in (*model.coefficients, model.missed)], axis=0)
    return where, Floats.exact(np.empty((n + 1, 0)))


def _end(constant: Real | None, count: int) -> Floats:
    """Return the `constant` end of a bound for `count` boxes; NaN, which shows nothing, if the end moves (None)."""
    return Floats.exact(np.full(count, np.nan)) if constant is None else stack([constant], (count,)).at(0)


def _model(models: Model, b: int) -> Model | None:
    """Return the model of one box in the arithmetic of mpmath; None if it is not finite."""
    every: Any = (*models.coefficients, models.missed)
    ends = [(float(c.low[b]), float(c.high[b])) for c in every]
    if not all(isfinite(low) and isfinite(high) for low, high in ends):
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
