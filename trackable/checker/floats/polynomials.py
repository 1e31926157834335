"""Polynomials that are nowhere negative on [−1, 1], many at once, by their Bernstein coefficients in float64."""

from fractions import Fraction
from functools import cache
from math import comb

import numpy as np

from trackable.checker.floats.intervals import Floats, Mask
from trackable.checker.watch import tick

_MOST_HALVINGS, _MOST_PIECES = 12, 10_000


def are_positive(polynomials: Floats) -> Mask:
    """Return where Σ_k a_k x^k ≥ 0 on [−1, 1] for certain; coefficients have the shape (n, B)."""
    count = polynomials.low.shape[1]
    pieces, of = _bernstein(polynomials), np.arange(count)
    unknown = np.zeros(count, dtype=bool)
    for _ in range(_MOST_HALVINGS):
        is_open = ~np.all(pieces.low >= 0, axis=0)
        # The outer coefficients are values: where they may be negative, halves do not help.
        lost = is_open & ~((pieces.low[0] >= 0) & (pieces.low[-1] >= 0))
        unknown[of[lost]] = True
        is_open &= ~unknown[of]
        if not np.any(is_open):
            return ~unknown
        of, pieces = np.tile(of[is_open], 2), _halves(pieces.at((slice(None), is_open)))
        if len(of) > _MOST_PIECES:
            break
    unknown[of] = True
    return ~unknown


def _bernstein(polynomials: Floats) -> Floats:
    """Return the Bernstein coefficients in y = (x + 1)/2."""
    table = _table(len(polynomials.low))
    found = table.at((slice(None), 0, None)) * polynomials.at((0, None))
    for k in range(1, len(polynomials.low)):
        found = found + table.at((slice(None), k, None)) * polynomials.at((k, None))
    return found


def _halves(b: Floats) -> Floats:
    """Return the coefficients of both halves of each polynomial (de Casteljau)."""
    left, right = [b.at(0)], [b.at(-1)]
    while len(b.low) > 1:
        tick()
        b = (b.at(slice(1, None)) + b.at(slice(None, -1))) / 2
        left, right = [*left, b.at(0)], [b.at(-1), *right]
    ends = [np.stack([*(getattr(c, end) for c in half)]) for end in ("low", "high") for half in (left, right)]
    return Floats(np.hstack(ends[:2]), np.hstack(ends[2:]))


@cache
def _table(n: int) -> Floats:
    """Return the Bernstein coefficients of x^k = (2 y − 1)^k in degree n − 1, in column k.

    x^k = Σ_j C(k, j) 2ʲ (−1)^(k − j) yʲ, and yʲ has the coefficients C(i, j)/C(n − 1, j).
    """

    def entry(i: int, k: int) -> Fraction:
        tick()
        return sum(
            (Fraction(comb(i, j) * comb(k, j) * 2**j * (-1) ** (k - j), comb(n - 1, j)) for j in range(min(i, k) + 1)),
            Fraction(0),
        )

    nearest = np.array([[float(entry(i, k)) for k in range(n)] for i in range(n)])
    off = np.abs(nearest) * 2.0**-52
    return Floats(nearest - off, nearest + off)
