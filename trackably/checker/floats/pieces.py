"""Polynomial pieces in float64: the bounds that they certainly keep, in all cells at once.

The mathematics is that of `piecewise`. Cells and the pieces that hold in them are found in whole numbers; times since a
breakpoint, and all that follows, are enclosed.
"""

from collections.abc import Sequence
from fractions import Fraction
from itertools import groupby, pairwise

import numpy as np

from trackably.checker.floats.intervals import Floats, joined
from trackably.checker.floats.polynomials import are_positive, substituted
from trackably.checker.intervals import ratio
from trackably.checker.piecewise import TooManyCellsError, bits_of, inner_breaks, place
from trackably.checker.quantities import functionals, weighted_sum
from trackably.checker.subject import Functional, Pieces, Subject
from trackably.checker.watch import tick

_COEFFICIENTS = 500_000
"""Of all terms in the cells that are looked at together: memory is enough, whatever a file says."""

_NEARLY = Floats(np.asarray(1 - 2.0**-52), np.asarray(1 + 2.0**-52))


def kept_by_pieces(
    subject: Subject, ends: Sequence[tuple[Fraction, Fraction]], start: Fraction, end: Fraction
) -> set[int]:
    """Return the numbers of the bounds that are certainly kept from start to end [s], drawn in to these `ends`."""
    rows = [weighted_sum(bound.row, functionals(subject, bound.of)) for bound in subject.bounds]

    def signals(i: int) -> list[int]:
        return [s for s, weights in enumerate(rows[i].weights) if any(weights)]

    found: set[int] = set()
    with np.errstate(all="ignore"):  # what is not finite is not proved
        for used, group in groupby(sorted(range(len(rows)), key=signals), signals):
            some = list(group)
            if used:
                kept = _kept(subject, used, [rows[i] for i in some], [ends[i] for i in some], (start, end))
                found |= {i for i, is_kept in zip(some, kept, strict=True) if is_kept}
    return found


def _kept(
    subject: Subject,
    used: Sequence[int],
    rows: Sequence[Functional],
    ends: Sequence[tuple[Fraction, Fraction]],
    times: tuple[Fraction, Fraction],
) -> list[bool]:
    """Return which rows, all of the same signals, stay between their ends."""
    step = Fraction(subject.system.sampling_time)
    terms = sorted({(s, j) for row in rows for s in used for j, w in enumerate(row.weights[s]) if w})
    bits = bits_of([step, *times, *(t for s in used for t in subject.pieces[s].ends)])
    whole = {s: [int(t * (1 << bits)) for t in subject.pieces[s].ends] for s in used}
    shifts = {(s, j): int(j * step * (1 << bits)) for s, j in terms}
    first, last = (int(t * (1 << bits)) for t in times)
    try:
        inner = inner_breaks(((subject.pieces[s], whole[s], shifts[s, j]) for s, j in terms), first, last)
    except TooManyCellsError:  # of all these rows, but maybe not of each
        return [False] * len(rows)
    cells = list(pairwise([first, *inner, last, last]))
    at_once = max(1, _COEFFICIENTS // (len(terms) * (1 + max(subject.pieces[s].degree for s in used))))
    kept = [True] * len(rows)
    for begin in range(0, len(cells), at_once):
        some = cells[begin : begin + at_once]
        known = {(s, j): _enclosed(subject.pieces[s], whole[s], shifts[s, j], some, bits) for s, j in terms}
        for i, (row, (low, high)) in enumerate(zip(rows, ends, strict=True)):
            kept[i] = kept[i] and _stays_inside(row, known, low, high)
    return kept


def _enclosed(z: Pieces, ends: Sequence[int], shift: int, cells: Sequence[tuple[int, int]], bits: int) -> Floats:
    """Return the coefficients of z(t + shift) in x ∈ [−1, 1] in each cell, which x runs through: (n, B)."""
    where = []
    for a, b in cells:
        tick()
        where.append(place(z, ends, a + shift, b - a))
    pieces = np.array(z.coefficients)[[i for i, _, _ in where]].T
    unit = 1 << (bits + 1)  # a quotient of whole numbers is rounded once
    middle = Floats.exact(np.array([(2 * local + width) / unit for _, local, width in where])) * _NEARLY
    half = Floats.exact(np.array([width / unit for _, _, width in where])) * _NEARLY
    return substituted(Floats.exact(pieces), middle, half)


def _stays_inside(row: Functional, known: dict[tuple[int, int], Floats], low: Fraction, high: Fraction) -> bool:
    parts = [known[s, j] * ratio(w) for s, weights in enumerate(row.weights) for j, w in enumerate(weights) if w]
    n, count = max(len(part.low) for part in parts), parts[0].low.shape[1]
    none = Floats.exact(np.zeros((n, count)))
    found = none
    for part in parts:
        missing = n - len(part.low)
        found = found + (joined([part, none.at(slice(missing))], axis=0) if missing else part)
    constant, others = found.at(slice(1)) + ratio(row.offset), found.at(slice(1, None))
    above, below = (joined([constant - ratio(low), others], axis=0), joined([ratio(high) - constant, -others], axis=0))
    return bool(np.all(are_positive(joined([above, below]))))
