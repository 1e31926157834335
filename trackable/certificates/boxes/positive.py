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

_HALVINGS = 21
_TOGETHER = 3  # halvings: few polynomials are left after the first of them


def are_positive(polynomials: Balls) -> Mask:
    """Whether polynomials with coefficients of shape (terms, B) are certainly ≥ 0 on all of [−1, 1]."""
    pieces, of = _times(_to_bernstein, polynomials), np.arange(polynomials.mid.shape[1])
    proved = np.ones(len(of), dtype=bool)
    for _ in range(_HALVINGS // _TOGETHER):
        is_positive = pieces.lowest >= 0
        proved[of[~(is_positive[0] & is_positive[-1])]] = False  # the values at the ends
        unsure = ~np.all(is_positive, axis=0) & proved[of]
        if not np.any(unsure):
            return proved
        of, pieces = np.repeat(of[unsure], 2**_TOGETHER), _parts(pieces.at((slice(None), unsure)))
    proved[of[~np.all(pieces.lowest >= 0, axis=0)]] = False
    return proved


def _parts(pieces: Balls) -> Balls:
    """Return all parts of each piece: shape (terms, parts · B), with those of a piece side by side."""
    terms, count = pieces.mid.shape
    of_parts = _times(_to_parts, pieces)
    mid, rad = (x.reshape(-1, terms, count).transpose(1, 2, 0).reshape(terms, -1) for x in (of_parts.mid, of_parts.rad))
    return Balls(mid, rad)


def _times(matrix: Callable[[int], Array], coefficients: Balls) -> Balls:
    """Apply a matrix whose entries are rounded."""
    exact = matrix(len(coefficients.mid))
    terms = len(coefficients.mid)
    rounded = coefficients.rad + (terms + 8) * U * np.abs(coefficients.mid)
    return Balls(exact @ coefficients.mid, sums_up(np.abs(exact) @ rounded, terms))


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
def _to_parts(terms: int) -> Array:
    """Return the matrix from Bernstein coefficients to those of all parts, one below the other (de Casteljau).

    Its entries are computed as multiples of a power of 2, and then rounded.
    """
    degree = terms - 1
    left = np.array([[comb(i, j) << (degree - i) for j in range(terms)] for i in range(terms)], dtype=object)
    halves, found = (
        np.concatenate([left, left[::-1, ::-1]]),
        np.array([[int(i == j) for j in range(terms)] for i in range(terms)], dtype=object),
    )
    for _ in range(_TOGETHER):
        found = np.concatenate([halves @ part for part in np.split(found, len(found) // terms)])
    return np.array(found / 2 ** (degree * _TOGETHER), dtype=float)
