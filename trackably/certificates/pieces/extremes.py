"""The largest value of polynomial pieces: branch and bound on Bernstein coefficients, in rational arithmetic.

A polynomial on [0, 1] is nowhere above the largest of its Bernstein coefficients, and the first and the last of them
are its values at 0 and 1. When a part is halved, the distance of both bounds falls by about four. So extremes are found
to any number of digits, whether or not a bound touches them.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from heapq import heappop, heappush
from itertools import pairwise
from math import comb

from flint import fmpq, fmpq_poly

from trackably.certificates.pieces.cells import Cell

_MOST_CUTS = 100_000


@dataclass(frozen=True)
class Extreme:
    """A largest value lies between `reached`, which is that at `time` [s] (or its limit there), and `at_most`."""

    reached: fmpq
    at_most: fmpq
    time: fmpq


@dataclass(frozen=True)
class _Part:
    """Bernstein coefficients of a part of a cell, which begins at `start` and takes `width` [s]."""

    coefficients: list[fmpq]
    start: fmpq
    width: fmpq

    @property
    def reached(self) -> tuple[fmpq, fmpq]:
        """The larger one of the values at both ends, and its time [s]."""
        first, last = self.coefficients[0], self.coefficients[-1]
        return (first, self.start) if first >= last else (last, self.start + self.width)


class Search:
    """The search for the largest value of `sign` times the cells; it can be continued when more digits are needed."""

    def __init__(self, cells: Iterable[Cell], sign: int) -> None:
        parts = [_Part([sign * b for b in bernstein(cell.polynomial)], cell.start, cell.width) for cell in cells]
        self._reached, self._time = max((part.reached for part in parts), key=lambda found: found[0])
        self._waiting: list[tuple[fmpq, int, _Part]] = []
        self._count = 0
        for part in parts:
            self._keep(part)

    def to(self, tolerance: fmpq) -> Extreme:
        """Return the extreme with both bounds this near to each other, or as near as they are after many cuts."""
        while self._waiting and -self._waiting[0][0] > self._reached + tolerance and self._count < _MOST_CUTS:
            for part in _halves(heappop(self._waiting)[2]):
                value, time = part.reached
                if value > self._reached:
                    self._reached, self._time = value, time
                self._keep(part)
        return Extreme(self._reached, -self._waiting[0][0] if self._waiting else self._reached, self._time)

    def _keep(self, part: _Part) -> None:
        """Look at a part later if it may hold more than is reached."""
        top = max(part.coefficients)
        if top > self._reached:
            self._count += 1
            heappush(self._waiting, (-top, self._count, part))


def bernstein(polynomial: fmpq_poly) -> list[fmpq]:
    """Return the Bernstein coefficients on [0, 1]: b_k = Σ_j C(k, j) a_j / C(n, j)."""
    a = polynomial.coeffs() or [fmpq(0)]
    n = len(a) - 1
    b = [fmpq(c) / comb(n, j) for j, c in enumerate(a)]
    for i in range(1, n + 1):
        for k in range(n, i - 1, -1):
            b[k] += b[k - 1]
    return b


def _halves(part: _Part) -> tuple[_Part, _Part]:
    """Return both halves, by de Casteljau's algorithm."""
    b, half = list(part.coefficients), part.width / 2
    left, right = [b[0]], [b[-1]]
    while len(b) > 1:
        b = [(x + y) / 2 for x, y in pairwise(b)]
        left.append(b[0])
        right.append(b[-1])
    return _Part(left, part.start, half), _Part(right[::-1], part.start + half, half)
