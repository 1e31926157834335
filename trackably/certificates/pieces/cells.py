"""A weighted sum of polynomial pieces at shifted times is again made of polynomial pieces: its cells, exactly."""

from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import pairwise

from flint import fmpq, fmpq_poly

from trackably.systems.flat.functional import Functional
from trackably.systems.signals.pieces import PolynomialPieces


@dataclass(frozen=True)
class Cell:
    """q(start + width x) = polynomial(x) for 0 ≤ x < 1, and its limit at 1 [s]; all numbers are exact."""

    start: fmpq
    width: fmpq
    polynomial: fmpq_poly


def cells(functional: Functional, signals: tuple["ExactPieces", ...], start: fmpq, end: fmpq) -> Iterator[Cell]:
    """Yield the cells of a functional from `start` to `end` [s], which meet at the shifted breakpoints of its signals.

    The last cell has no width: it holds the value at the end.
    """
    step = exactly(functional.sampling_time)
    terms = [
        (rational(w), signals[c], j * step)
        for c, weights in enumerate(functional.weights)
        for j, w in enumerate(weights)
        if w
    ]
    offset = rational(functional.offset)
    inner = {t for _, signal, shift in terms for t in signal.breaks(start + shift, end + shift, shift)}
    for a, b in pairwise([start, *sorted(inner), end, end]):
        total = fmpq_poly([offset])
        for weight, signal, shift in terms:
            total += weight * signal.polynomial(a + shift, b - a)
        yield Cell(a, b - a, total)


@dataclass(frozen=True, eq=False)
class ExactPieces:
    """The rational numbers of a signal."""

    signal: PolynomialPieces

    @cached_property
    def ends(self) -> list[fmpq]:
        """All breakpoints [s]."""
        return [exactly(t) for t in self.signal.breakpoints.tolist()]

    @cached_property
    def period(self) -> fmpq:
        """From the first to the last breakpoint [s]."""
        return self.ends[-1] - self.ends[0]

    @cached_property
    def pieces(self) -> list[fmpq_poly]:
        """The polynomials of t − t_i."""
        return [fmpq_poly([exactly(c) for c in row]) for row in self.signal.coefficients.tolist()]

    @cached_property
    def last(self) -> fmpq_poly:
        """The value at which the signal comes to rest, if it does."""
        return fmpq_poly([self.pieces[-1](self.ends[-1] - self.ends[-2])])

    def breaks(self, start: fmpq, end: fmpq, shift: fmpq) -> Iterator[fmpq]:
        """Yield t − shift for all breakpoints t between start and end [s], and for those that repeat them."""
        turns, ends = [0], self.ends
        if self.signal.beyond == "period":
            first, last = ((t - ends[0]) / self.period for t in (start, end))
            turns, ends = list(range(int(first.floor()), int(last.floor()) + 1)), ends[:-1]
        for turn in turns:
            moved = turn * self.period
            low, high = bisect_right(ends, start - moved), bisect_right(ends, end - moved)
            for t in ends[low:high]:
                if t + moved < end:
                    yield t + moved - shift

    def polynomial(self, t: fmpq, width: fmpq) -> fmpq_poly:
        """Return z(t + width x) for 0 ≤ x < 1 as a polynomial in x: no breakpoint lies between."""
        if self.signal.beyond == "period":
            t = t - ((t - self.ends[0]) / self.period).floor() * self.period
        i = bisect_right(self.ends, t) - 1
        if self.signal.beyond == "rest" and not 0 <= i < len(self.pieces):
            return self.last if i >= 0 else fmpq_poly([self.pieces[0][0]])
        i = min(max(i, 0), len(self.pieces) - 1)
        return self.pieces[i](fmpq_poly([t - self.ends[i], width]))


def exactly(number: float) -> fmpq:
    """Return the rational number that a float64 is."""
    return fmpq(*number.as_integer_ratio())


def rational(number: Fraction) -> fmpq:
    """Return the same number."""
    return fmpq(number.numerator, number.denominator)
