"""Polynomials that are nowhere negative on [−1, 1], many at once, by their Bernstein coefficients in float64."""

from collections.abc import Callable
from fractions import Fraction
from functools import cache
from math import comb

import numpy as np

from trackably.checker.floats.intervals import Array, Floats, Mask, joined
from trackably.checker.watch import tick

_MOST_HALVINGS, _MOST_PIECES = 12, 10_000


def are_positive(polynomials: Floats) -> Mask:
    """Return where Σ_k a_k x^k ≥ 0 on [−1, 1] for certain; coefficients have the shape (n, B)."""
    return _are_positive(_bernstein(polynomials))


def _are_positive(pieces: Floats) -> Mask:
    """Return where polynomials with these Bernstein coefficients, (n, B), are ≥ 0 for certain: they, or their parts."""
    count = pieces.low.shape[1]
    of = np.arange(count)
    unknown = np.zeros(count, dtype=bool)
    for _ in range(_MOST_HALVINGS):
        tick()
        is_open = ~np.all(pieces.low >= 0, axis=0)
        # The outer coefficients are values: where they may be negative, halves do not help.
        lost = is_open & ~((pieces.low[0] >= 0) & (pieces.low[-1] >= 0))
        unknown[of[lost]] = True
        is_open &= ~unknown[of]
        if not np.any(is_open):
            return ~unknown
        tick()
        of, pieces = np.tile(of[is_open], 2), _halves(pieces.at((slice(None), is_open)))
        if len(of) > _MOST_PIECES:
            break
    unknown[of] = True
    return ~unknown


def _bernstein(polynomials: Floats) -> Floats:
    """Return the Bernstein coefficients in y = (x + 1)/2."""
    found: Floats = _matrix(_of_powers, len(polynomials.low)) @ polynomials
    return found


def _halves(b: Floats) -> Floats:
    """Return the coefficients of both halves of each polynomial (de Casteljau): of the left one, Σ_j C(i, j) b_j/2ⁱ."""
    matrix, turned = _matrix(_of_left_half, len(b.low)), slice(None, None, -1)
    return joined([matrix @ b, (matrix @ b.at(turned)).at(turned)])


@cache
def _matrix(entry: Callable[[int, int, int], Fraction], n: int) -> Floats:
    nearest = np.array([[float(entry(n, i, k)) for k in range(n)] for i in range(n)])
    off = np.abs(nearest) * 2.0**-52
    return Floats(nearest - off, nearest + off)


def _of_powers(n: int, i: int, k: int) -> Fraction:
    """Return the Bernstein coefficient i of x^k = (2 y − 1)^k in degree n − 1.

    x^k = Σ_j C(k, j) 2ʲ (−1)^(k − j) yʲ, and yʲ has the coefficients C(i, j)/C(n − 1, j).
    """
    tick()
    return sum(
        (Fraction(comb(i, j) * comb(k, j) * 2**j * (-1) ** (k - j), comb(n - 1, j)) for j in range(min(i, k) + 1)),
        Fraction(0),
    )


def _of_left_half(_: int, i: int, k: int) -> Fraction:
    return Fraction(comb(i, k), 2**i)


def substituted(c: Floats, a: Floats, b: Floats) -> Floats:
    """Return the coefficients of p(a + b x), by Horner's rule, of the polynomials with coefficients c: (n, B)."""
    found, none = c.at(slice(-1, None)), Floats.exact(np.zeros((1, c.low.shape[1])))
    for k in reversed(range(len(c.low) - 1)):
        tick()
        found = joined([c.at(slice(k, k + 1)), b * found], axis=0) + joined([a * found, none], axis=0)
    return found


@cache
def bernstein(n: int) -> Array:
    """Return C(i, j)/C(n − 1, j): the Bernstein coefficient i of yʲ in degree n − 1."""
    return np.array([[comb(i, j) / comb(n - 1, j) for j in range(n)] for i in range(n)])


def stay_between(near: Floats, least: Array, most: Array) -> Mask:
    """Return which polynomials, of which these are the Bernstein coefficients, stay between two numbers for certain."""
    kept: Mask = np.all((near.low >= least) & (near.high <= most), axis=0)
    left = np.flatnonzero(~kept)
    if len(left):
        b, sides = near.at((slice(None), left)), (Floats.exact(least[left]), Floats.exact(most[left]))
        kept[left] = np.all(_are_positive(joined([b - sides[0], sides[1] - b])).reshape(2, -1), axis=0)
    return kept
