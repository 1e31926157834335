"""A weighted sum of shifted signals is one polynomial between any two of their shifted breakpoints: its cells.

All float64 numbers are whole multiples of a power of two. So times are counted in units of 2^−e s, and values in such
units that every polynomial has whole coefficients.
"""

from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise

from trackably.checker.arithmetic.intervals import common_denominator, exact_sum
from trackably.checker.limits import CELLS
from trackably.checker.pieces import Pieces
from trackably.checker.subject import Functional, Subject
from trackably.checker.watch import UndecidedError, require_room, tick


@dataclass(frozen=True)
class Term:
    """`weight` · z(t + shift), in the units of a `Sum`: the polynomials are those of the time since a breakpoint."""

    signal: Pieces
    weight: int
    shift: int
    ends: Sequence[int]
    polynomials: Sequence[Sequence[int]]


@dataclass(frozen=True)
class Sum:
    """offset + Σ terms: `unit` times the value is a whole number, and so is 2^`bits` times each time [s]."""

    offset: int
    terms: tuple[Term, ...]
    unit: int
    bits: int

    def cells(self, start: int, end: int) -> Iterator[list[int]]:
        """Yield polynomials in x ∈ [0, 1] that are the sum between breakpoints, from start to end, and the value there.

        At each breakpoint, both what holds before (a limit) and what holds from it on are among them.
        """
        inner: set[int] = set()
        for term in self.terms:
            for t in _breaks(term, start, end):
                tick()
                inner.add(t)
                if len(inner) > CELLS:
                    raise UndecidedError(f"not decided with {CELLS} breakpoints of one bound")
        for a, b in pairwise([start, *sorted(inner), end, end]):
            tick()
            yield self.polynomial(a, b - a)

    def polynomial(self, start: int, width: int) -> list[int]:
        """Return the coefficients in x of the sum at start + width x, where no breakpoint lies between."""
        found = [self.offset]
        for term in self.terms:
            tick()
            part = _shifted(term, start + term.shift, width)
            found += [0] * (len(part) - len(found))
            for k, coefficient in enumerate(part):
                found[k] += term.weight * coefficient
        return found


def _breaks(term: Term, start: int, end: int) -> Iterator[int]:
    """Yield the times after start and before end at which the term's polynomial changes."""
    ends, period = term.ends, term.ends[-1] - term.ends[0]
    turns = range(1)
    if term.signal.beyond == "period":
        turns = range((start + term.shift - ends[0]) // period, (end + term.shift - ends[0]) // period + 1)
    for turn in turns:
        moved = turn * period - term.shift
        for t in ends[bisect_right(ends, start - moved) :]:
            if t + moved >= end:
                break
            yield t + moved


def _shifted(term: Term, t: int, width: int) -> Sequence[int]:
    """Return the coefficients in x of the signal at t + width x."""
    ends, kind = term.ends, term.signal.beyond
    if kind == "period":
        t = ends[0] + (t - ends[0]) % (ends[-1] - ends[0])
    if kind == "rest" and not ends[0] <= t < ends[-1]:
        last = len(term.polynomials) - 1
        i, local = (0, 0) if t < ends[0] else (last, ends[-1] - ends[last])
        return [_composed(term.polynomials[i], local, 0)[0]]
    i = min(max(bisect_right(ends, t) - 1, 0), len(term.polynomials) - 1)
    return _composed(term.polynomials[i], t - ends[i], width)


def _composed(polynomial: Sequence[int], start: int, width: int) -> list[int]:
    """Return the coefficients in x of p(start + width x), by Horner's rule."""
    found = [polynomial[-1]]
    for coefficient in reversed(polynomial[:-1]):
        higher = [width * c for c in found]
        found = [start * c for c in found] + [0]
        for k, c in enumerate(higher):
            found[k + 1] += c
        found[0] += coefficient
    return found


def whole_sum(
    subject: Subject,
    row: Sequence[Fraction],
    parts: Sequence[Functional],
    times: Sequence[Fraction],
    bounds: Sequence[Fraction] = (),
) -> Sum:
    """Return Σ_i row_i part_i of signals, in units in which these `times` [s] and `bounds` are whole, too."""
    pairs = list(zip(row, parts, strict=True))
    weights = [
        [exact_sum(r * part.weights[s][j] for r, part in pairs) for j in range(len(shifts))]
        for s, shifts in enumerate(parts[0].weights)
    ]
    offset, step = exact_sum(r * part.offset for r, part in pairs), Fraction(subject.system.sampling_time)
    bits = _bits([step, *(t for z in subject.pieces for t in z.ends), *times])
    fine = _bits([*(Fraction(c) for z in subject.pieces for piece in z.coefficients for c in piece), *bounds])
    digits = fine + bits * max(z.degree for z in subject.pieces)
    require_room(sum(len(z.coefficients) * (z.degree + 1) for z in subject.pieces), digits)
    scale, divisor = 1 << digits, common_denominator([offset, *(w for of_signal in weights for w in of_signal)])
    terms = []
    for z, of_signal in zip(subject.pieces, weights, strict=True):
        ends = [_whole(t * (1 << bits)) for t in z.ends]
        polynomials = [[_scaled(c, scale >> bits * k) for k, c in enumerate(p)] for p in z.coefficients]
        for j, w in enumerate(of_signal):
            if w:
                terms.append(Term(z, _whole(divisor * w), _whole(j * step * (1 << bits)), ends, polynomials))
    return Sum(_whole(offset * divisor * scale), tuple(terms), divisor * scale, bits)


def value_at(subject: Subject, row: Sequence[Fraction], parts: Sequence[Functional], t: Fraction) -> Fraction:
    """Return the value of Σ_i row_i part_i at a time [s] that is a sum of float64 numbers."""
    q = whole_sum(subject, row, parts, [t])
    return Fraction(q.polynomial(_whole(t * (1 << q.bits)), 0)[0], q.unit)


def _bits(numbers: Sequence[Fraction]) -> int:
    """Return the least e such that 2^e times each number, which is a float64, is whole."""
    return max(number.denominator.bit_length() - 1 for number in numbers)


def _scaled(number: float, scale: int) -> int:
    tick()
    numerator, denominator = number.as_integer_ratio()
    return numerator * scale // denominator  # units are chosen so that this is exact


def _whole(number: Fraction) -> int:
    assert number.denominator == 1, "units are chosen so"
    return number.numerator
