"""The first pass: find the boxes in which quantities certainly stay inside their bounds, in float64.

An instant is checked as a narrow box around it.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from math import isfinite
from typing import Any

import numpy as np

from trackably.checker.boxes import Box, Enclosures, FirstPass
from trackably.checker.floats.intervals import Floats, Mask, bernstein_on_box, stay_between, sums
from trackably.checker.floats.pieces import cells_left, undecided
from trackably.checker.floats.signals import Boxes, ManyCentres, Models
from trackably.checker.formulas import parts
from trackably.checker.intervals import Real, UndefinedError, between, exactly
from trackably.checker.kernels import Decay
from trackably.checker.models import Model
from trackably.checker.moving import Limit
from trackably.checker.quantities import LinearCombination, Quantity, Shifted, shifts_of, terms_of
from trackably.checker.rounding import FormulaNeeds, FormulaValues
from trackably.checker.subject import Pieces, Signal, Subject

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
    signals = {shifted: many_centres(subject, shifted) for shifted in sorted(_needs(every.values()))}
    formulas = {f for q in every.values() for f in (*(f for _, f in q.parts), *(need.formula for need in q.needs))}
    for some in _batches(list(held), terms * (len(signals) + sum(len(parts(formula)) for formula in formulas))):
        inside = {name: [any(q is each for each in held[box]) for box in some] for name, q in every.items()}
        proved = {name: np.zeros(len(some), dtype=bool) for name in every}
        needed_in, every_box = [_needs(held[box]) for box in some], Boxes(*np.array(some).T)
        used = {shifted: np.flatnonzero([shifted in each for each in needed_in]) for shifted in signals}
        with np.errstate(all="ignore"):  # results that are not finite prove nothing
            found = {s: of.enclose(every_box.at(used[s]), terms) for s, of in signals.items() if len(used[s])}
            for name, q in every.items():
                where = np.flatnonzero(inside[name])
                models = {s: found[s].at(np.searchsorted(used[s], where)) for s in _needs([q]) if len(where)}
                if models:  # a quantity without signals is a constant, which is not decided here
                    proved[name][where] = _stays_inside(needs, subject, q, models, [some[b] for b in where])
        yield from ((box, [q for q in held[box] if not proved[q.name][b]]) for b, box in enumerate(some))


def models(
    subject: Subject, wanted: Sequence[Shifted], boxes: Sequence[Box], terms: int
) -> Iterator[dict[Shifted, Model]]:
    """Yield for each box models of shifted signals in the arithmetic of mpmath, without those that are not finite."""
    signals = {shifted: many_centres(subject, shifted) for shifted in wanted}
    for some in _batches(list(boxes), terms * (len(wanted) + 1)):
        with np.errstate(all="ignore"):
            found = {shifted: of.enclose(Boxes(*np.array(some).T), terms) for shifted, of in signals.items()}
        for b in range(len(some)):
            known = {shifted: _model(of, b) for shifted, of in found.items()}
            yield {shifted: model for shifted, model in known.items() if model}


def _batches(boxes: list[Box], coefficients: int) -> Iterator[list[Box]]:
    """Return the boxes in groups, small enough to be processed at once if each box takes so many `coefficients`."""
    at_once = max(1, min(_AT_ONCE, _COEFFICIENTS // max(1, coefficients)))
    return (boxes[begin : begin + at_once] for begin in range(0, len(boxes), at_once))


def _needs(quantities: Iterable[Quantity]) -> set[Shifted]:
    return {shifted for q in quantities for argument in q.arguments.values() for shifted in shifts_of(argument)}


def many_centres(subject: Subject, shifted: Shifted) -> ManyCentres:
    """Return z_s(t + j T) − m_s for `shifted` = (s, j)."""
    s, j = shifted
    return ManyCentres.of(subject.signals[s], j * Fraction(subject.system.sampling_time))


def _stays_inside(
    needs: FormulaNeeds, subject: Subject, q: Quantity, models: Mapping[Shifted, Models], boxes: Sequence[Box]
) -> Mask:
    """Return a mask of the boxes in which a quantity is certainly defined and stays inside its bounds."""
    n, count = next(iter(models.values())).coefficients.low.shape
    where, proved = np.arange(count), np.zeros(count, dtype=bool)
    while len(where):
        known = {shifted: of.at(where) for shifted, of in models.items()}
        try:
            found = _combine(q, known) if not _is_formula(q) else _evaluate(needs, subject, q, known, n)
        except UndefinedError as undefined:
            where = where[np.broadcast_to(undefined.where, where.shape)]
            continue
        low, high = (_limits(limit, [boxes[b] for b in where.tolist()], n) for limit in (q.lower, q.upper))
        missed = _constant(n) * found.missed.b
        proved[where] = stay_between(*map(bernstein_on_box, (found.coefficients, low + missed, high - missed)))
        break
    return proved


def _limits(limit: Limit, boxes: Sequence[Box], n: int) -> Floats:
    """Return the coefficients of a limit's polynomial in each box, of shape (n, B), or (n, 1) if it is constant.

    The coefficients are NaN in a box in which the limit is not one polynomial with at most n coefficients.
    """
    if not isinstance(limit.end, Pieces):
        boxes = boxes[:1]
    low, high = np.full((2, n, len(boxes)), np.nan)
    for b, box in enumerate(boxes):
        if len(every := limit.over(box.start, box.end)) == 1 and len(every[0]) <= n:
            low[:, b] = high[:, b] = 0.0
            for k, c in enumerate(map(Floats.of, every[0])):
                low[k, b], high[k, b] = c.low, c.high
    return Floats(low, high)


def _combine(q: Quantity, models: Mapping[Shifted, Models]) -> Models:
    """Return models of a linear combination of signals."""
    assert q.combination is not None, "it is no formula"
    first, *others = (models[shifted].times(weight) for shifted, weight in terms_of(q.combination))
    found = sum(others, first)
    return Models(found.coefficients + _constant(len(found.coefficients.low)) * q.combination.offset, found.missed)


def _evaluate(needs: FormulaNeeds, subject: Subject, q: Quantity, models: Mapping[Shifted, Models], n: int) -> Models:
    """Return models of a formula, with n coefficients each. Raise UndefinedError if it may be undefined."""
    many: Any = models  # arrays of intervals take the place of single intervals
    known = {key: Model([of.coefficients.at(k) for k in range(n)], of.missed) for key, of in many.items()}
    arguments = Enclosures(subject, n, _NO_BOX, known).arguments(q)
    model = FormulaValues(needs, n).enclose(q, arguments)
    none = np.zeros((1, len(next(iter(models.values())).missed.low)))
    rows = [Floats.of(c) for c in model.coefficients]
    ends = (np.concatenate([end + none for end in of]) for of in ([c.low for c in rows], [c.high for c in rows]))
    return Models(Floats(*ends), Floats.of(model.missed))


def _is_formula(q: Quantity) -> bool:
    """Return whether a quantity is a formula, or has conditions under which formulas are defined."""
    return q.combination is None or bool(q.needs)


def _constant(n: int) -> Floats:
    """Return the polynomial 1 with n coefficients."""
    return Floats.exact(np.eye(n)[:, :1])


def _model(models: Models, b: int) -> Model | None:
    """Return the model of one box in the arithmetic of mpmath; None if it is not finite."""
    of, missed = models.coefficients, float(models.missed.high[b])
    lows, highs = of.low[:, b].tolist(), of.high[:, b].tolist()
    if not all(map(isfinite, (*lows, *highs, missed))):
        return None
    return Model([between(low, high) for low, high in zip(lows, highs, strict=True)], exactly(missed))


def envelope(signal: Signal, start: Real) -> Decay | None:
    """Over-estimate |z − m| and |ż| for all times after `start`; None if they are not finite."""
    with np.errstate(all="ignore"):
        distance: Any = Floats.of(start) - Floats.exact(np.array(signal.centres))
        each = signal.kernel.beyond(distance.choose(distance.low >= 0, distance, 0.0))
        sizes, first = abs(Floats.exact(np.array(signal.weights))), np.zeros(1, dtype=np.intp)
        size, slope = (float(sums(sizes * part, first, len(signal.weights)).high[0]) for part in each)
    return Decay(exactly(size), exactly(slope)) if isfinite(size) and isfinite(slope) else None


def at_zero(subject: Subject, argument: LinearCombination) -> Real | None:
    """Return an interval that contains the linear combination at t = 0; None if it is not finite."""
    found = Floats.of(argument.offset)
    with np.errstate(all="ignore"):
        for shifted, weight in terms_of(argument):
            found = found + many_centres(subject, shifted).at(0.0) * weight
    low, high = (float(end.max()) for end in (found.low, found.high))
    return between(low, high) if isfinite(low) and isfinite(high) else None


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
FIRST_PASS = FirstPass(boxes_left, models, envelope, cells_left, undecided, at_zero, keeps_subnormals, _TRUSTED)
"""The first pass in arrays of float64 intervals."""
