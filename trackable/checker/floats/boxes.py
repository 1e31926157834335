"""Step 2 of the proof in float64: find the boxes in which quantities certainly stay inside their bounds."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from itertools import groupby
from math import isfinite
from operator import itemgetter

import numpy as np

from trackable.checker.arithmetic.intervals import Real, between, exactly, ratio
from trackable.checker.arithmetic.models import Model
from trackable.checker.floats.intervals import Floats, Mask
from trackable.checker.floats.polynomials import are_positive
from trackable.checker.floats.signals import Boxes, ManyCentres, Models
from trackable.checker.steps.enclosures import Box
from trackable.checker.steps.quantities import LinearCombination, Quantity
from trackable.checker.subject import Subject
from trackable.checker.watch import tick

Shifted = tuple[int, int]
"""The signal s at the shifted time t + j T."""

_AT_ONCE, _COEFFICIENTS = 256, 2_000_000
"""Boxes, and Taylor coefficients in them: memory is enough, whatever a file says."""

_WIDER = 1.1
"""By how much a box may become wider where shifts share a model: 16 terms then miss up to 5 times as much."""


def boxes_left(
    subject: Subject, terms: int, held: Mapping[Box, list[Quantity]]
) -> Iterator[tuple[Box, list[Quantity], dict[Shifted, Model]]]:
    """Yield each box with the quantities that are not proved here, and with models of the signals that they need.

    Only linear combinations of signals are proved here, and only for other quantities there are models.
    """
    unshifted = {s: many_centres(subject, (s, 0)) for s in range(len(subject.signals))}
    needed = _needed([q for h in held.values() for q in h])
    signals = {(s, j): replace(unshifted[s], shift=_shift(subject, j)) for s, j in needed}
    boxes, at_once = list(held), max(1, min(_AT_ONCE, _COEFFICIENTS // (terms * max(1, len(needed)))))
    for begin in range(0, len(boxes), at_once):
        some = boxes[begin : begin + at_once]
        with np.errstate(all="ignore"):  # what is not finite is not proved
            found = _enclosed(signals, terms, some, [_needed(held[box]) for box in some])
            quantities = {q.name: q for box in some for q in held[box]}
            proved = {name: _stays_inside(q, found) for name, q in quantities.items()}
        for b, box in enumerate(some):
            rest = [q for q in held[box] if (where := proved[q.name]) is None or not where[b]]
            models = {shifted: _model(found[shifted], b) for shifted in _needed(list(filter(_is_formula, rest)))}
            yield box, rest, {shifted: model for shifted, model in models.items() if model}


def _needed(quantities: Sequence[Quantity]) -> set[Shifted]:
    return {shifted for q in quantities for argument in q.arguments.values() for shifted in _shifted(argument)}


def _shifted(argument: LinearCombination) -> list[Shifted]:
    return [(s, j) for s, weights in enumerate(argument.weights) for j, w in enumerate(weights) if w]


def terms_of(argument: LinearCombination) -> Iterator[tuple[Shifted, Real]]:
    """Return the shifted signals of a linear combination, with their weights."""
    for s, j in _shifted(argument):
        tick()
        yield (s, j), ratio(argument.weights[s][j])


def many_centres(subject: Subject, shifted: Shifted) -> ManyCentres:
    """Return a shifted signal, without its mean."""
    s, j = shifted
    return ManyCentres.of(subject.signals[s], _shift(subject, j))


def _shift(subject: Subject, j: int) -> Fraction:
    return j * Fraction(subject.system.sampling_time)


def _enclosed(
    signals: Mapping[Shifted, ManyCentres], terms: int, boxes: Sequence[Box], needed: Sequence[set[Shifted]]
) -> dict[Shifted, Models]:
    """Return the models of the shifted signals in the boxes that need them; NaN in the others.

    Where a box is hardly wider with all its shifts, one model of the signal over all these times serves each of them.
    """
    every, found = Boxes(*np.array(boxes).T), dict[Shifted, Models]()
    for _, group in groupby(sorted(set[Shifted]().union(*needed)), itemgetter(0)):
        shifts = list(group)
        one, last = signals[shifts[0]], signals[shifts[-1]]
        wide = every.over(one.exact_shift, last.exact_shift)
        uses = np.array([[shifted in each for each in needed] for shifted in shifts])
        can_share = len(shifts) > 1 and not one.kernel.has_kink
        is_shared = np.any(uses, axis=0) & (wide.halves <= _WIDER * every.halves) & can_share
        shared = np.flatnonzero(is_shared)
        models = replace(one, shift=Fraction(0)).enclose(wide.at(shared), terms) if len(shared) else None
        for shifted, is_used in zip(shifts, uses, strict=True):
            alone, parts = np.flatnonzero(is_used & ~is_shared), list[Models]()
            if models:
                parts.append(models.inside(wide.at(shared), every.at(shared), signals[shifted].exact_shift))
            if len(alone):
                parts.append(signals[shifted].enclose(every.at(alone), terms))
            found[shifted] = Models.joined(parts).spread(np.concatenate([shared, alone]), len(boxes))
    return found


def _stays_inside(q: Quantity, models: Mapping[Shifted, Models]) -> Mask | None:
    """Return in which boxes a linear combination of signals certainly stays inside its bounds; None for others."""
    if q.combination is None or _is_formula(q):
        return None
    summands = [models[shifted].times(weight) for shifted, weight in terms_of(q.combination)]
    if not summands:
        return None
    found = sum(summands[1:], summands[0])
    first = found.coefficients.at(0) + q.combination.offset
    above, below = first - q.lower - found.missed.b, q.upper - first - found.missed.b
    return are_positive(_begun(above, found.coefficients)) & are_positive(_begun(below, -found.coefficients))


def _is_formula(q: Quantity) -> bool:
    """Return whether a quantity is a formula, or needs some."""
    return q.combination is None or bool(q.needs)


def _begun(first: Floats, polynomials: Floats) -> Floats:
    """Return polynomials with another first coefficient."""
    ends = ((first.low, polynomials.low), (first.high, polynomials.high))
    return Floats(*(np.vstack([begin, rest[1:]]) for begin, rest in ends))


def _model(models: Models, b: int) -> Model | None:
    """Return the model of one box in the arithmetic of mpmath; None where nothing is known."""
    of, missed = models.coefficients, float(models.missed.high[b])
    lows, highs = of.low[:, b].tolist(), of.high[:, b].tolist()
    if not all(map(isfinite, (*lows, *highs, missed))):
        return None
    return Model([between(low, high) for low, high in zip(lows, highs, strict=True)], exactly(missed))
