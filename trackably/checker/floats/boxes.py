"""The first pass of a check: find the boxes in which quantities certainly stay inside their bounds, in float64.

A box is an interval of time. An instant is checked as a narrow box around it.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from fractions import Fraction
from itertools import zip_longest
from math import isfinite
from typing import Any

import numpy as np

from trackably.checker.boxes import Box, FirstPass, is_never_negative
from trackably.checker.floats.intervals import Floats, Mask, bernstein_of, stack, sums
from trackably.checker.floats.signals import Indices, ManyCentres
from trackably.checker.intervals import ZERO, Real, UndefinedError, around, between, exactly, total
from trackably.checker.kernels import Decay
from trackably.checker.models import Model
from trackably.checker.quantities import LinearCombination, Quantity, Shifted, shifts_of, terms_of
from trackably.checker.rounding import FormulaNeeds, FormulaValues
from trackably.checker.subject import Pieces, Signal, Subject

_AT_ONCE, _COEFFICIENTS = 256, 2_000_000
"""Boxes and Taylor coefficients that are processed at once, to limit the memory for any file."""


def boxes_left(
    needs: FormulaNeeds, subject: Subject, terms: int, held: Mapping[Box, list[Quantity]]
) -> Iterator[tuple[Box, list[Quantity]]]:
    """Yield each box with those of its quantities that float64 does not show to stay inside their bounds.

    `held` has the quantities of each box, and `terms` is the number of Taylor coefficients.
    """
    every = {q.name: q for h in held.values() for q in h}.values()
    wanted = {shifted for q in every for a in q.arguments.values() for shifted in shifts_of(a)}
    for some, known in _enclosed(subject, wanted, list(held), terms, 2 * len(every)):
        shown = set[tuple[str, int]]()
        with np.errstate(all="ignore"):  # results that are not finite prove nothing
            for q in every:
                where = np.array([b for b, box in enumerate(some) if q in held[box]], dtype=np.intp)
                where, found = _polynomials_of(needs, q, known, where, terms)
                inside = stay_inside(found, q, [some[b] for b in where])
                shown |= {(q.name, b) for b in where[inside].tolist()}
        for b, box in enumerate(some):
            yield box, [q for q in held[box] if (q.name, b) not in shown]


def stay_inside(found: Floats, q: Quantity, boxes: Sequence[Box]) -> Mask:
    """Return in which of B boxes a quantity q certainly stays inside its bounds.

    Column b of `found`, (n, B), has the coefficients in x ∈ [−1, 1] of the polynomial that encloses q in box b. It is
    compared with each polynomial that an end of a bound has there.
    """
    n, shown = len(found.low), np.ones(len(boxes), dtype=bool)
    for limit, is_lower in ((q.lower, True), (q.upper, False)):
        every = boxes if isinstance(limit.end, Pieces) else boxes[:1]  # a constant end is the same in all boxes
        ends = [(b, p) for b, box in enumerate(every) for p in limit.over(box.start, box.end)]
        rows = zip_longest(*([around(p[0], total(map(abs, p[n:]))), *p[1:n]] for _, p in ends), fillvalue=ZERO)
        columns, at = [stack(row, ()) for row in rows], np.array([b for b, _ in ends], dtype=np.intp)
        at = at if every is boxes else np.arange(len(boxes))
        end, of = stack([*columns, *[ZERO] * (n - len(columns))], (len(ends),)), found.at((slice(None), at))
        shown[at[~nowhere_negative(of - end if is_lower else end - of)]] = False
    return shown


def nowhere_negative(polynomials: Floats) -> Mask:
    """Return which of B polynomials Σ_k a_k x^k, (n, B), are certainly ≥ 0 for all x ∈ [−1, 1].

    A polynomial is nowhere negative if its Bernstein coefficients are all ≥ 0. The first and the last one are its
    values at the ends: if one may be negative, the claim is not shown. Otherwise, which is rare, integers decide.
    """
    bernstein = bernstein_of(polynomials).low
    shown: Mask = np.all(bernstein >= 0, axis=0)
    for b in np.flatnonzero(~shown & np.all(bernstein[[0, -1]] >= 0, axis=0)).tolist():
        shown[b] = is_never_negative(Model(_intervals(polynomials.at((..., b))), ZERO))
    return shown


def _intervals(of: Floats) -> list[Real]:
    """Return finite float64 intervals, of shape (n,), as intervals of mpmath."""
    return [*map(between, of.low.tolist(), of.high.tolist())]


def models(
    subject: Subject, wanted: Sequence[Shifted], boxes: Sequence[Box], terms: int
) -> Iterator[dict[Shifted, Model]]:
    """Yield for each box models of shifted signals in the arithmetic of mpmath, without those that are not finite."""
    for some, known in _enclosed(subject, wanted, boxes, terms, 0):
        for b in range(len(some)):
            yield {shifted: model for shifted, of in known.items() if (model := _model(of.at((..., b))))}


def _enclosed(
    subject: Subject, wanted: Collection[Shifted], boxes: Sequence[Box], terms: int, more: int
) -> Iterator[tuple[Sequence[Box], dict[Shifted, Floats]]]:
    """Yield groups of B boxes with Taylor models of shifted signals without their means, as arrays (terms + 1, B).

    The last row has the bounds of the remainders. The number of boxes in a group limits the memory for models of the
    `wanted` signals and for `more` models of other functions.
    """
    shifts: dict[int, list[int]] = {s: [j for of, j in sorted(wanted) if of == s] for s in {s for s, _ in wanted}}
    signals, step = {s: ManyCentres.of(subject.signals[s]) for s in shifts}, Fraction(subject.system.sampling_time)
    at_once = max(1, min(_AT_ONCE, _COEFFICIENTS // (terms * (len(wanted) + more + 1))))
    for begin in range(0, len(boxes), at_once):
        some, known = boxes[begin : begin + at_once], dict[Shifted, Floats]()
        for s, of in signals.items():
            with np.errstate(all="ignore"):
                found = of.models(some, [j * step for j in shifts[s]], terms)
            known |= {(s, j): found.at(i) for i, j in enumerate(shifts[s])}
        yield some, known


def _polynomials_of(
    needs: FormulaNeeds, q: Quantity, known: Mapping[Shifted, Floats], where: Indices, n: int
) -> tuple[Indices, Floats]:
    """Return the indices, among `where`, of the B boxes in which q is certainly defined, and its polynomials, (n, B).

    The first coefficients contain the remainders. `known` has models of shifted signals in all boxes.
    """
    while len(where):
        arguments = {name: _combination(argument, known, where, n) for name, argument in q.arguments.items()}
        try:
            model = FormulaValues(needs, n).enclose(q, arguments)
        except UndefinedError as undefined:
            where = where[np.broadcast_to(undefined.where, where.shape)]
            continue
        first, *others = model.coefficients
        return where, stack([around(first, model.missed), *others], where.shape)
    return where, Floats.exact(np.empty((n, 0)))


def _combination(argument: LinearCombination, known: Mapping[Shifted, Floats], where: Indices, n: int) -> Model:
    """Return models of a linear combination of shifted signals in the boxes `where`."""
    found = Floats.exact(np.zeros((n + 1, len(where))))
    for shifted, w in terms_of(argument):
        found = known[shifted].at((slice(None), where)) * stack([*[w] * n, abs(w)], (1,)) + found
    every: list[Any] = [found.at(k) for k in range(n + 1)]
    return Model([every[0] + argument.offset, *every[1:n]], every[n])


def _model(of_box: Floats) -> Model | None:
    """Return the model of one box in the arithmetic of mpmath, from its coefficients and its bound of the remainder.

    Return None if the model is not finite.
    """
    if not np.isfinite([of_box.low, of_box.high]).all():
        return None
    *coefficients, missed = _intervals(of_box)
    return Model(coefficients, missed.b)


def envelope(signal: Signal, start: Real) -> Decay | None:
    """Over-estimate |z − m| and |ż| of a signal z with mean m, for all times after `start` [s]; None if not finite."""
    with np.errstate(all="ignore"):
        distance: Any = Floats.of(start) - Floats.exact(signal.centres)
        each = signal.kernel.beyond(distance.choose(distance.low >= 0, distance, 0.0))
        sizes, first = abs(Floats.exact(signal.weights)), np.array([0])
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
FIRST_PASS = FirstPass(boxes_left, models, envelope, keeps_subnormals, _TRUSTED)
"""The first pass in arrays of float64 intervals."""
