"""Piecewise polynomials with rational coefficients, and their exact extremes between grid points."""

from bisect import bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from heapq import heappop, heappush
from itertools import pairwise
from math import comb, factorial
from typing import Self

import numpy as np
from scipy.interpolate import PPoly

from trackably.arrays import Array

Polynomial = tuple[Fraction, ...]
"""Coefficients of 1, τ, τ², … with τ the time since the piece began."""

_MOST_BOXES = 200_000


@dataclass(frozen=True, eq=False)
class Pieces:
    """Polynomials `parts` between `breaks` [s]: piece i is Σ_k parts[i][k] (t − breaks[i])ᵏ up to breaks[i + 1].

    Numbers are exact. Nothing is said of continuity: at a break both pieces count.
    """

    breaks: tuple[Fraction, ...]
    parts: tuple[Polynomial, ...]

    @classmethod
    def of(cls, given: PPoly) -> Self:
        """Return SciPy's piecewise polynomial of one variable, exactly as it is stored."""
        parts = [tuple(map(Fraction, column[::-1])) for column in given.c.T.tolist()]
        return cls(tuple(map(Fraction, given.x.tolist())), tuple(parts))

    def __call__(self, t: Array) -> Array:
        """Return values at t [s] in float64, shape of t; outside of the breaks the end pieces go on."""
        return np.asarray(self.as_scipy(np.asarray(t, dtype=float)))

    def derivative(self) -> Self:
        """Return the derivative of each piece."""
        parts = tuple(tuple(k * a for k, a in enumerate(part))[1:] or (Fraction(0),) for part in self.parts)
        return type(self)(self.breaks, parts)

    def shifted(self, by: Fraction) -> Self:
        """Return t ↦ p(t + by)."""
        return type(self)(tuple(t - by for t in self.breaks), self.parts)

    def within(self, start: Fraction, end: Fraction) -> Self:
        """Return the part between two times; the end pieces go on beyond the breaks."""
        inside = [t for t in self.breaks if start < t < end]
        breaks = (start, *inside, end)
        return type(self)(breaks, tuple(self._around(t) for t in breaks[:-1]))

    def at(self, t: Fraction) -> Fraction:
        """Return the exact value at t [s]."""
        return self._around(t)[0]

    def _around(self, t: Fraction) -> Polynomial:
        """Return the polynomial that begins at t, about t."""
        i = min(max(bisect_right(self.breaks, t) - 1, 0), len(self.parts) - 1)
        by, part = t - self.breaks[i], self.parts[i]
        return tuple(
            sum((comb(k, j) * part[k] * by ** (k - j) for k in range(j, len(part))), Fraction(0))
            for j in range(len(part))
        )

    @cached_property
    def as_scipy(self) -> PPoly:
        """The same in float64: exactly, if that is what it was made of."""
        longest = max(map(len, self.parts))
        columns = [[float(a) for a in (*part, *[Fraction(0)] * (longest - len(part)))][::-1] for part in self.parts]
        return PPoly(np.array(columns).T, np.array([float(t) for t in self.breaks]))


@dataclass(frozen=True, eq=False)
class Combination:
    """offset + Σ w p for the `terms` (w, p): its pieces, with all breaks of all p, are made where they are needed."""

    terms: tuple[tuple[Fraction, Pieces], ...]
    offset: Fraction = Fraction(0)

    def within(self, start: Fraction, end: Fraction) -> Pieces:
        """Return the pieces between two times [s], exactly."""
        return combined(self.terms, self.offset, start, end)

    def at(self, t: Fraction) -> Fraction:
        """Return the exact value at t [s]."""
        return sum((w * p.at(t) for w, p in self.terms), self.offset)

    def __call__(self, t: Array) -> Array:
        """Return values at t [s] in float64, shape of t."""
        return np.asarray(sum((float(w) * p(t) for w, p in self.terms), np.full(np.shape(t), float(self.offset))))

    @cached_property
    def as_scipy(self) -> PPoly:
        """The same between the first and the last break, up to rounding."""
        given = [(float(w), p.as_scipy) for w, p in self.terms]
        breaks = np.unique(np.concatenate([p.x for _, p in given]))
        degree = max(len(p.c) for _, p in given) - 1
        # Taylor coefficients at the breaks; at its own break a piece begins.
        rows = [sum(w * p(breaks[:-1], k) / factorial(k) for w, p in given) for k in range(degree, -1, -1)]
        return PPoly(np.array(rows) + float(self.offset) * (np.arange(degree, -1, -1) == 0)[:, None], breaks)


def combined(terms: Iterable[tuple[Fraction, Pieces]], offset: Fraction, start: Fraction, end: Fraction) -> Pieces:
    """Return offset + Σ w p between two times, with all breaks of all p."""
    terms = list(terms)
    inside = sorted({t for _, p in terms for t in p.breaks if start < t < end})
    breaks = (start, *inside, end)
    cut = [(w, [p._around(t) for t in breaks[:-1]]) for w, p in terms]
    return Pieces(breaks, tuple(_sum([(w, parts[i]) for w, parts in cut], offset) for i in range(len(breaks) - 1)))


def _sum(terms: Sequence[tuple[Fraction, Polynomial]], offset: Fraction) -> Polynomial:
    longest = max((len(p) for _, p in terms), default=1)
    total = [offset, *[Fraction(0)] * (longest - 1)]
    for w, p in terms:
        for k, a in enumerate(p):
            total[k] += w * a
    return tuple(total)


@dataclass(frozen=True)
class Largest:
    """The largest value is at least `least`, taken at `time` [s], and at most `most`: exact numbers."""

    least: Fraction
    most: Fraction
    time: Fraction


def largest(pieces: Pieces, tolerance: Fraction) -> Largest:
    """Enclose the largest value, to within `tolerance`.

    On each part, the value is at most the largest Bernstein coefficient. Parts are halved where that is the largest.
    """
    queue: list[tuple[Fraction, int, Polynomial, Fraction, Fraction]] = []
    best = (pieces.parts[0][0], pieces.breaks[0])
    for i, ((start, end), part) in enumerate(zip(pairwise(pieces.breaks), pieces.parts, strict=True)):
        b = bernstein(part, end - start)
        best = max(best, (b[0], start), (b[-1], end))
        heappush(queue, (-max(b), i, b, start, end))
    for count in range(len(queue), _MOST_BOXES):
        top, _, b, start, end = heappop(queue)
        if -top - best[0] <= tolerance:
            return Largest(best[0], max(-top, best[0]), best[1])
        middle = (start + end) / 2
        left, right = halved(b)
        best = max(best, (right[0], middle))
        heappush(queue, (-max(left), 2 * count, left, start, middle))
        heappush(queue, (-max(right), 2 * count + 1, right, middle, end))
    return Largest(best[0], -queue[0][0], best[1])


def bernstein(part: Polynomial, length: Fraction) -> Polynomial:
    """Return the Bernstein coefficients on [0, length]: b_k = Σ_i C(k, i)/C(n, i) a_i lengthⁱ."""
    n, scaled = len(part) - 1, [a * length**i for i, a in enumerate(part)]
    return tuple(
        sum((Fraction(comb(k, i), comb(n, i)) * scaled[i] for i in range(k + 1)), Fraction(0)) for k in range(n + 1)
    )


def halved(b: Polynomial) -> tuple[Polynomial, Polynomial]:
    """Return the Bernstein coefficients on both halves (de Casteljau)."""
    left, right, row = [b[0]], [b[-1]], list(b)
    while len(row) > 1:
        row = [(x + y) / 2 for x, y in pairwise(row)]
        left.append(row[0])
        right.append(row[-1])
    return tuple(left), tuple(reversed(right))
