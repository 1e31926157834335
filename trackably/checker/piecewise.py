"""Polynomial pieces, an extension: bounds of piecewise polynomial signals, by rational arithmetic.

Theorem. Instead of sums of kernels, all signals of a linear system may be z_s(t) = Σ_j c_ij (t − t_i)^j for
t_i ≤ t < t_(i+1); beyond the first and the last piece they are at rest, periodic, or not claimed. Everything else in
the theorem of `checker` stays the same, except for evaluation: the signals are evaluated in double-double arithmetic,
at times that are not rounded, and each state or input is rounded to float64 once.

Proof. Between two breakpoints t_i − j T of its signals, a bounded quantity is one polynomial with rational
coefficients. In each of these cells, closed on both sides, it is shown to keep its bounds, tightened by the stated
errors. With x = y/(1 + y), a polynomial p(x) of degree n becomes (1 + y)⁻ⁿ Σ b_k y^k, and 0 ≤ x ≤ 1 becomes y ≥ 0.
If all b_k ≥ 0, p is nowhere negative; otherwise the cell is halved. For all_times, the cells reach from 0 to
`tail_start`, from which on all signals are at rest; for all_phases, over one period; for a window, from start to end,
and a signal that ends must be known until the last t + j T. An end of a bound that moves (`moving`) is one more signal,
whose breakpoints cut cells, too. The rounding errors are shown to be at most the stated ones. No step is checked in
float64 first.

Times are counted in such units, fractions of a second, that all of them are whole numbers, and values in such units
that every polynomial has whole coefficients.
"""

from collections.abc import Iterator, Sequence
from fractions import Fraction
from functools import lru_cache
from itertools import zip_longest
from math import lcm

from trackably.checker.answers import FailedStepError
from trackably.checker.certificate import AllPhases, AllTimes, Certificate, Steps
from trackably.checker.intervals import UndefinedError, common_denominator, exact_sum, in_whole_numbers
from trackably.checker.moving import cells_of, hull, place, value_of_signal
from trackably.checker.polynomials import compose, is_nowhere_negative
from trackably.checker.quantities import functionals, gross_of, shifts_of, weighted_sum
from trackably.checker.rounding import check_range, check_stated
from trackably.checker.subject import Bound, End, Functional, Pieces, Subject
from trackably.checker.watch import progress, require_room, tick

Parts = tuple[Fraction, list[tuple[Pieces, Fraction, Fraction]]]
"""The sum offset + Σ weight · z(t + shift): the offset, and a triple (z, shift [s], weight) for each term."""

_Term = tuple[Pieces, list[int], list[list[int]], int, int]
"""A signal z, with its breakpoints, its coefficients, a shift and the factor of the coefficients, in integers."""


def in_cells(
    sums: Sequence[Parts], start: Fraction, end: Fraction, number: Fraction = Fraction(0)
) -> tuple[int, Iterator[list[list[int]]]]:
    """Return a unit, and for each cell between breakpoints from start to end [s] the coefficients of all `sums`.

    These are weighted sums of signals. In a cell, from a to b, they are polynomials in x at the times a + (b − a) x,
    0 ≤ x ≤ 1. They are multiplied by the unit, an integer with which all coefficients, and `number`, become integers.
    Times are counted in seconds divided by an integer, too.
    """
    terms = [term for _, of in sums for term in of]
    signals = {id(z): z for z, _, _ in terms}
    times = [start, end, *(shift for _, shift, _ in terms), *(t for z in signals.values() for t in z.ends)]
    second = common_denominator(times)
    known = {key: _in_whole_numbers(z, second) for key, z in signals.items()}
    divisor = common_denominator([number, *(offset for offset, _ in sums), *(weight for _, _, weight in terms)])
    of_all = lcm(*(own for *_, own in known.values()))

    def term(z: Pieces, shift: Fraction, weight: Fraction) -> _Term:
        ends, polynomials, own = known[id(z)]
        return z, ends, polynomials, whole(shift * second), whole(weight * divisor) * (of_all // own)

    scaled = [(whole(offset * divisor) * of_all, [term(*of_one) for of_one in of]) for offset, of in sums]
    cuts = [(z, ends, shift) for _, of in scaled for z, ends, _, shift, _ in of]
    cells = cells_of(cuts, whole(start * second), whole(end * second))

    def polynomial(offset: int, of: Sequence[_Term], a: int, width: int) -> list[int]:
        found = [offset]
        for z, ends, polynomials, shift, factor in of:
            tick()
            i, local, of_piece = place(z, ends, a + shift, width)
            moved = compose(polynomials[i], local, of_piece)
            found = [p + factor * q for p, q in zip_longest(found, moved, fillvalue=0)]
        return found

    return divisor * of_all, ([polynomial(*of, a, b - a) for of in scaled] for a, b in cells)


def parts_of(subject: Subject, row: Functional) -> Parts:
    """Return a weighted sum of a subject's shifted signals, with the pieces and the shift [s] of each term."""
    step = Fraction(subject.system.sampling_time)
    return row.offset, [(subject.pieces[s], j * step, row.weights[s][j]) for s, j in shifts_of(row)]


def values_at(subject: Subject, rows: Sequence[Functional], t: Fraction) -> list[Fraction]:
    """Return the value of each of the `rows`, weighted sums of shifted signals, at the time t [s]."""
    every = (parts_of(subject, row) for row in rows)
    return [exact_sum([offset, *(w * value_of_signal(z, t + shift) for z, shift, w in of)]) for offset, of in every]


@lru_cache(maxsize=32)  # many rows are made of the same few signals
def _in_whole_numbers(z: Pieces, second: int) -> tuple[list[int], list[list[int]], int]:
    """Return breakpoints in units of 1/second s, coefficients for times in these units, times a factor, and the factor.

    UndecidedError: these integers would have too many bits together.
    """
    own, rows = in_whole_numbers(z.coefficients)
    powers = [second**k for k in reversed(range(z.degree + 1))]
    require_room(sum(map(len, rows)), (own * powers[0]).bit_length())
    found = [[c * power for c, power in zip(row, powers, strict=True)] for row in rows]
    return [whole(t * second) for t in z.ends], found, own * powers[0]


def whole(number: Fraction) -> int:
    """Return a number, which has to be an integer, as an int."""
    assert number.denominator == 1, "units are chosen so"
    return number.numerator


UNIT, _TINY = Fraction(1, 2**53), Fraction(1, 2**300)
_LARGEST, _LARGEST_POWER, _HIGHEST = 1e30, 10**100, 50


def check_sizes(certificate: Certificate) -> None:
    """Raise FailedStepError if a number may be too large or too small for float64 evaluation.

    With such a number, evaluation could overflow, or a factor could be lost by underflow.
    """
    subject = certificate.subject
    for z in subject.pieces:
        largest = max(map(abs, (*z.breakpoints, *(c for piece in z.coefficients for c in piece))))
        if largest > _LARGEST or z.degree > _HIGHEST or max([*z.lengths, Fraction(1)]) ** z.degree > _LARGEST_POWER:
            raise FailedStepError(
                "sizes: rounding is bounded only for numbers up to 1e30, degrees d up to 50, and pieces of L s with "
                "L^d ≤ 1e100"
            )
    factors = [length for z in subject.pieces for length in z.lengths]
    for bound in subject.bounds:
        weights, offset = gross_of(bound.row, functionals(subject, bound.of))
        factors += [*weights, offset]
    check_range(certificate, [], factors)


def check_rounding(certificate: Certificate) -> None:
    """Raise FailedStepError at the first bound whose quantity may have a larger rounding error than stated."""
    _check_periods(certificate)
    check_stated(certificate, evaluation_errors(certificate.subject, *_span(certificate)).items())


def evaluation_errors(subject: Subject, start: Fraction, end: Fraction) -> dict[str, Fraction]:
    """Over-estimate the rounding error of each bounded quantity from `start` to `end` [s].

    States and inputs are evaluated in double-double arithmetic, at times that are not rounded, and rounded to float64
    once. So Σ_i r_i x_i with p weights r_i ≠ 0 takes one rounding of each x_i, p products and p − 1 sums, of numbers
    bounded by Σ_i |r_i x_i| in total, and one rounding of each r_i. Operations of double-double arithmetic have errors
    of at most 8 u² times the sum of the absolute terms: two for each power of the time since a breakpoint, which itself
    has an error of 80 u², and two for each shifted signal, whose weight has an error of u². All of this is to first
    order in the unit roundoff u, and enlarged by 1 %.
    """
    largest = [_largest((Fraction(0), [(z, Fraction(0), Fraction(1))]), z.ends[0], z.ends[-1]) for z in subject.pieces]
    operations = 96 * (max(z.degree for z in subject.pieces) + 1) + 17 * (sum(subject.shifts) + 1)
    found = dict[str, Fraction]()
    for bound in subject.bounds:
        weights, offset = gross_of(bound.row, functionals(subject, bound.of))
        gross = exact_sum([offset, *(w * size for w, size in zip(weights, largest, strict=True) if w)])
        used = sum(1 for r in bound.row if r)
        error = (used + 2) * UNIT * _size(subject, start, end, bound) + operations * UNIT**2 * gross
        found[bound.name] = Fraction(101, 100) * error + _TINY * (1 + exact_sum(weights))
    return found


def _check_periods(certificate: Certificate) -> None:
    """Raise FailedStepError unless float64 counts the periods of signals exactly up to the time `until`."""
    ahead = max(certificate.subject.shifts) * Fraction(certificate.subject.system.sampling_time)
    for z in certificate.subject.pieces:
        if z.beyond == "period" and not Fraction(certificate.until) + ahead + abs(z.ends[0]) <= 2**50 * z.period:
            raise FailedStepError("evaluation: up to the time `until` there are more periods than float64 can count")


def _size(subject: Subject, start: Fraction, end: Fraction, bound: Bound) -> Fraction:
    """Over-estimate Σ_i |r_i x_i| from `start` to `end` [s], for the row r of a bound and states or inputs x.

    If the row has only one state or input, the row's bounds are used. A later step proves these bounds, and does not
    rely on the errors that follow from them here.
    """
    used = [(r, part) for r, part in zip(bound.row, functionals(subject, bound.of), strict=True) if r]
    if len(used) == 1:
        return max(map(abs, hull(bound)))
    return exact_sum(abs(r) * _largest(parts_of(subject, part), start, end) for r, part in used)


def _largest(of: Parts, start: Fraction, end: Fraction) -> Fraction:
    """Over-estimate the absolute value of a weighted sum of signals from `start` to `end` [s].

    The over-estimate is the sum of the |coefficients| of its polynomial, the largest of all cells between breakpoints.
    """
    unit, cells = in_cells([of], start, end)
    return Fraction(max(sum(map(abs, polynomial)) for (polynomial,) in cells), unit)


def _span(certificate: Certificate) -> tuple[Fraction, Fraction]:
    assert not isinstance(certificate.proof, Steps), "refused before"
    return Fraction(certificate.proof.start), Fraction(certificate.proof.end)


def check_pieces(certificate: Certificate) -> None:
    """Raise FailedStepError at the first step of the proof that fails for signals of polynomial pieces."""
    _check_claim(certificate)
    check_sizes(certificate)
    check_rounding(certificate)
    _check_cells(certificate)


def _check_claim(certificate: Certificate) -> None:
    """Raise FailedStepError unless bounds that hold from the proof's start to its end imply the claim."""
    proof, pieces = certificate.proof, certificate.subject.pieces
    assert not isinstance(proof, Steps), "not read for pieces"
    bounds = [end for bound in certificate.subject.bounds for end in (bound.low, bound.high)]
    pieces = (*pieces, *(end for end in bounds if isinstance(end, Pieces)))
    start, end = proof.start, proof.end
    match certificate.claim:
        case AllTimes():
            if not all(z.beyond == "rest" and z.breakpoints[-1] <= end for z in pieces):
                raise FailedStepError(f"claim: a signal or a moving bound is not at rest from {end!r} s on")
        case AllPhases():
            if not all(z.beyond == "period" and z.period == Fraction(end) for z in pieces):
                raise FailedStepError(f"period: a signal or a moving bound does not repeat after {end!r} s")
        case _:
            if not start < end:
                raise FailedStepError(f"claim: a window needs start < end, got {start!r} s and {end!r} s")
            try:
                _require_defined(certificate.subject, Fraction(start), Fraction(end))
            except UndefinedError as undefined:
                raise FailedStepError(str(undefined)) from None


def _require_defined(subject: Subject, start: Fraction, end: Fraction) -> None:
    """Raise UndefinedError if a signal is undefined at some time on which states and inputs depend."""
    for s, (z, shifts) in enumerate(zip(subject.pieces, subject.shifts, strict=True)):
        ahead = (shifts - 1) * Fraction(subject.system.sampling_time)
        if z.beyond == "end" and not (z.ends[0] <= start and end + ahead <= z.ends[-1]):
            known = f"got {z.breakpoints[0]!r} s to {z.breakpoints[-1]!r} s"
            times = f"from {float(start)!r} s to {float(end + ahead)!r} s"
            raise UndefinedError(f"claim: signal {s} must be defined {times}, {known}")


def value_of_pieces(subject: Subject, bound: Bound, t: Fraction) -> Fraction:
    """Return the value of a bound's row at a time [s]. Raise UndefinedError if a signal is undefined there."""
    _require_defined(subject, t, t)
    return values_at(subject, [row_of(subject, bound)], t)[0]


def _check_cells(certificate: Certificate) -> None:
    """Raise FailedStepError at the first bound that is not shown to hold in all cells between breakpoints."""
    subject = certificate.subject
    for k, bound in enumerate(subject.bounds):
        progress(k, len(subject.bounds))
        error = Fraction(certificate.errors[bound.name])
        if not keeps(subject, row_of(subject, bound), _span(certificate), (bound.low, bound.high), error):
            start, end = map(float, _span(certificate))
            raise FailedStepError(
                f"cell: the {bound.name} is not shown to stay inside its bounds from {start!r} s to {end!r} s",
                bound.name,
            )


def row_of(subject: Subject, bound: Bound) -> Functional:
    """Return the row of a bound as a weighted sum of shifted signals."""
    return weighted_sum(bound.row, functionals(subject, bound.of))


def keeps(
    subject: Subject,
    row: Functional,
    times: tuple[Fraction, Fraction],
    ends: tuple[End | Fraction, End | Fraction],
    error: Fraction = Fraction(0),
) -> bool:
    """Return whether a row is shown to stay between two ends, an `error` away from both, between two times [s]."""
    moving = (
        (Fraction(0), [(end, Fraction(0), Fraction(1))]) if isinstance(end, Pieces) else (Fraction(end), [])
        for end in ends
    )
    unit, cells = in_cells([parts_of(subject, row), *moving], *times, error)
    apart = whole(error * unit)
    return all(
        is_nowhere_negative(_difference(value, low, apart)) and is_nowhere_negative(_difference(high, value, apart))
        for value, low, high in cells
    )


def _difference(p: Sequence[int], q: Sequence[int], apart: int) -> list[int]:
    """Return the coefficients of p − q − apart."""
    first, *others = (a - b for a, b in zip_longest(p, q, fillvalue=0))
    return [first - apart, *others]
