"""Polynomials on [−1, 1] that are certainly positive, many at once, by their Bernstein coefficients in float64.

A polynomial lies in the convex hull of its Bernstein coefficients. Where those of the whole box do not decide, the box
is halved a few times: Bernstein coefficients of either half are weighted means of those of the whole.
"""

from collections.abc import Callable
from fractions import Fraction
from functools import cache
from math import comb

import numpy as np

from trackable.arrays import Array
from trackable.certificates.floats.balls import Balls, Mask, U, sums_up

_HALVINGS = 20


def are_positive(polynomials: Balls) -> Mask:
    """Whether polynomials with coefficients of shape (terms, B) are certainly ≥ 0 on all of [−1, 1]."""
    pieces, of = _times(_to_bernstein, polynomials), np.arange(polynomials.mid.shape[1])
    undecided = np.zeros(len(of), dtype=bool)
    refuted = undecided.copy()
    for _ in range(_HALVINGS):
        least = pieces.lowest
        refuted[of[~((least[0] >= 0) & (least[-1] >= 0))]] = True  # the values at the ends
        unsure = ~np.all(least >= 0, axis=0) & ~refuted[of]
        if not np.any(unsure):
            return ~refuted
        of, pieces = np.tile(of[unsure], 2), _halves(pieces.at((slice(None), unsure)))
    undecided[of[~np.all(pieces.lowest >= 0, axis=0)]] = True
    return ~(refuted | undecided)


def _halves(pieces: Balls) -> Balls:
    left, right = _times(_left, pieces), _times(_right, pieces)
    return Balls(np.hstack([left.mid, right.mid]), np.hstack([left.rad, right.rad]))


def _times(matrix: Callable[[int], Array], coefficients: Balls) -> Balls:
    """Apply a matrix whose entries are rounded."""
    exact = matrix(len(coefficients.mid))
    size = np.abs(exact)
    rounded = coefficients.rad + (len(exact) + 8) * U * np.abs(coefficients.mid)
    return Balls(exact @ coefficients.mid, sums_up(size @ rounded, len(exact)))


@cache
def _to_bernstein(terms: int) -> Array:
    """Return the matrix from coefficients in x to Bernstein coefficients on [−1, 1].

    With x = 2 y − 1, x^k = Σ_j C(k, j) 2ʲ (−1)^(k − j) yʲ, and yʲ has the Bernstein coefficients C(i, j)/C(n, j).
    """
    n = terms - 1

    def entry(i: int, k: int) -> Fraction:
        return sum(
            (Fraction(comb(i, j) * comb(k, j) * 2**j * (-1) ** (k - j), comb(n, j)) for j in range(min(i, k) + 1)),
            Fraction(0),
        )

    return np.array([[float(entry(i, k)) for k in range(terms)] for i in range(terms)])


@cache
def _left(terms: int) -> Array:
    """Return the matrix from Bernstein coefficients to those of the left half (de Casteljau)."""
    return np.array([[comb(i, j) / 2**i if j <= i else 0.0 for j in range(terms)] for i in range(terms)])


@cache
def _right(terms: int) -> Array:
    return _left(terms)[::-1, ::-1].copy()
