"""The first pass: find the boxes in which quantities certainly stay inside their bounds, in float64.

An instant is checked as a narrow box around it.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from math import isfinite
from typing import Any

import numpy as np

from trackably.checker.boxes import Box, Enclosures, FirstPass, stays_inside
from trackably.checker.floats.intervals import Floats, bernstein_on_box, join, stay_between, sums
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
    for some, known in _enclosed(subject, wanted, list(held), terms, sum(len(parts(formula)) for formula in formulas)):
        proved = set[tuple[Box, str]]()
        for q in every.values():
            where = np.flatnonzero([any(q is each for each in held[box]) for box in some])
            with np.errstate(all="ignore"):  # results that are not finite prove nothing
                kept = _stays_inside(needs, subject, q, known, some, where, terms)
            proved.update((some[b], q.name) for b in kept.tolist())
        yield from ((box, [q for q in held[box] if (box, q.name) not in proved]) for box in some)


def models(
    subject: Subject, wanted: Sequence[Shifted], boxes: Sequence[Box], terms: int
) -> Iterator[dict[Shifted, Model]]:
    """Yield for each box models of shifted signals in the arithmetic of mpmath, without those that are not finite."""
    for some, known in _enclosed(subject, wanted, boxes, terms):
        for b in range(len(some)):
            of_box = {shifted: _model(of, b) for shifted, of in known.items()}
            yield {shifted: model for shifted, model in of_box.items() if model}


def _enclosed(
    subject: Subject, wanted: Iterable[Shifted], boxes: Sequence[Box], terms: int, others: int = 0
) -> Iterator[tuple[Sequence[Box], dict[Shifted, Model]]]:
    """Yield groups of boxes with models of shifted signals without their means, as arrays with an entry for each box.

    Groups are small enough to be processed at once if each box takes as many models of signals as are `wanted`, and
    that many `others`.
    """
    signals = {shifted: many_centres(subject, shifted) for shifted in sorted(wanted)}
    at_once = max(1, min(_AT_ONCE, _COEFFICIENTS // (terms * (len(signals) + 1 + others))))
    for begin in range(0, len(boxes), at_once):
        some = boxes[begin : begin + at_once]
        with np.errstate(all="ignore"):
            known = {shifted: of.enclose(Boxes(*np.array(some).T), terms) for shifted, of in signals.items()}
        yield some, known


def _needs(q: Quantity) -> list[Shifted]:
    return [shifted for argument in q.arguments.values() for shifted in shifts_of(argument)]


def many_centres(subject: Subject, shifted: Shifted) -> ManyCentres:
    """Return z_s(t + j T) − m_s for `shifted` = (s, j)."""
    s, j = shifted
    return ManyCentres.of(subject.signals[s], j * Fraction(subject.system.sampling_time))


def _stays_inside(
    needs: FormulaNeeds,
    subject: Subject,
    q: Quantity,
    known: Mapping[Shifted, Any],
    boxes: Sequence[Box],
    where: Indices,
    n: int,
) -> Indices:
    """Return those of the indices `where` of boxes in which q is certainly defined and stays inside its bounds.

    `known` has models of shifted signals in all boxes, with n coefficients.
    """
    start = exactly(min(box.start for box in boxes))
    while len(where):
        at = {s: Model([c.at(where) for c in known[s].coefficients], known[s].missed.at(where)) for s in _needs(q)}
        try:
            model = FormulaValues(needs, n).enclose(q, Enclosures(subject, n, _NO_BOX, at).arguments(q))
        except UndefinedError as undefined:
            where = where[np.broadcast_to(undefined.where, where.shape)]
            continue
        none, stays = Floats.exact(np.zeros(len(where))), np.zeros(len(where), dtype=bool)
        every: Any = [none + c for c in (*model.coefficients, model.missed)]
        (first, *others, missed), (low, high) = every, (limit.after(start) for limit in (q.lower, q.upper))
        if low is not None and high is not None:  # the ends do not move in these boxes
            near = join([c.at(None) for c in (around(first, missed), *others)], axis=0)
            stays = stay_between(bernstein_on_box(near), low, high)
        for i in np.flatnonzero(~stays).tolist():
            of_box = _model(Model([first, *others], missed), i)
            stays[i] = of_box is not None and stays_inside(of_box, q, boxes[where[i]])
        return where[stays]
    return where


def _model(models: Model, b: int) -> Model | None:
    """Return the model of one box in the arithmetic of mpmath; None if it is not finite."""
    every: Any = (*models.coefficients, models.missed)
    ends = [(float(c.low[b]), float(c.high[b])) for c in every]
    if not all(isfinite(low) and isfinite(high) for low, high in ends):
        return None
    return Model([between(*of) for of in ends[:-1]], exactly(ends[-1][1]))


def envelope(signal: Signal, start: Real) -> Decay | None:
    """Over-estimate |z − m| and |ż| for all times after `start`; None if they are not finite."""
    with np.errstate(all="ignore"):
        distance: Any = Floats.of(start) - Floats.exact(np.array(signal.centres))
        each = signal.kernel.beyond(distance.choose(distance.low >= 0, distance, 0.0))
        sizes, first = abs(Floats.exact(np.array(signal.weights))), np.zeros(1, dtype=np.intp)
        size, slope = (float(sums(sizes * part, first, len(signal.weights)).high[0]) for part in each)
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
