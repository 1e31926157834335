"""Polynomial pieces, a theorem beside the base: bounds of piecewise polynomial signals, by rational arithmetic.

Signals. Instead of sums of kernels, all signals of a linear system may be z_s(t) = Σ_j c_ij (t − t_i)^j for
t_i ≤ t < t_(i+1); beyond the last piece they are at rest, periodic, or not claimed. Nothing else changes in what is
proved. They are evaluated in double-double arithmetic, at times that are not rounded; each state or input is rounded to
float64 once.

Proof. Between two breakpoints t_i − j T of its signals, a bounded quantity is one polynomial with rational
coefficients. In each of these cells, closed on both sides, it is shown to keep its bounds, tightened by the stated
errors. With x = y/(1 + y), a polynomial p(x) of degree n becomes (1 + y)⁻ⁿ Σ b_k y^k, and 0 ≤ x ≤ 1 becomes y ≥ 0:
where all b_k ≥ 0, p is nowhere negative; where some are not, the cell is halved. For all_times the cells reach from 0
to `tail_start`, where all signals are at rest; for all_phases over one period; for a window from start to end, where a
signal that ends must be known until the last t + j T. The rounding errors are at most the stated ones. The first pass
(`floats.pieces`) encloses the same polynomials in float64 intervals, all cells at once; which piece holds in which cell
is decided in whole numbers.

All float64 numbers are whole multiples of a power of two. So times are counted in units of 2^−e s, and values in such
units that every polynomial has whole coefficients.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from math import ceil

from trackably.checker.boxes import NO_FIRST_PASS, FirstPass
from trackably.checker.certificate import AllPhases, AllTimes, Certificate, Steps
from trackably.checker.intervals import UndefinedError, common_denominator, exact_sum
from trackably.checker.moving import Cells, cells_of, compose, hull, place
from trackably.checker.polynomials import stays_between
from trackably.checker.quantities import functionals, gross_of, shifted_signal, shifts_of, weighted_sum
from trackably.checker.subject import Bound, Functional, LinearSystem, OfBound, Pieces, Subject, why_no_signal
from trackably.checker.watch import progress, require_room, short, tick


@dataclass(frozen=True)
class Term:
    """`weight` · z(t + shift), in the units of a `Sum`, in which all numbers are integers.

    `ends` are the breakpoints of z, and `polynomials` its pieces, as functions of the time since their start.
    """

    signal: Pieces
    weight: int
    shift: int
    ends: Sequence[int]
    polynomials: Sequence[Sequence[int]]


@dataclass(frozen=True)
class Sum:
    """offset + Σ terms, scaled so that all numbers are integers: the result is `unit` times the actual sum."""

    offset: int
    terms: tuple[Term, ...]
    unit: int

    def polynomial(self, start: int, width: int) -> list[int]:
        """Return the coefficients in x of the sum at start + width x, 0 ≤ x ≤ 1, where no breakpoint is in between."""
        found = [self.offset]
        for term in self.terms:
            tick()
            i, local, of_piece = place(term.signal, term.ends, start + term.shift, width)
            part = compose(term.polynomials[i], local, of_piece)
            found += [0] * (len(part) - len(found))
            for k, coefficient in enumerate(part):
                found[k] += term.weight * coefficient
        return found


def whole_sum(subject: Subject, q: Functional, bits: int, bounds: Sequence[Fraction] = ()) -> Sum:
    """Return the functional q of the signals, in units in which all numbers and the `bounds` are integers.

    Times are in units of 2^−`bits` s.
    """
    step = Fraction(subject.system.sampling_time)
    used = [(z, weights) for z, weights in zip(subject.pieces, q.weights, strict=True) if any(weights)]
    fine = max(bits_of(c for z, _ in used for piece in z.coefficients for c in piece), bits_of(bounds))
    digits = fine + bits * max((z.degree for z, _ in used), default=0)
    require_room(sum(len(z.coefficients) * (z.degree + 1) for z, _ in used), digits)
    scale, divisor = 1 << digits, common_denominator([q.offset, *(w for _, weights in used for w in weights)])
    terms = []
    for z, weights in used:
        ends = exact_times(z, bits)
        polynomials = [_whole_polynomial(piece, digits, bits) for piece in z.coefficients]
        for j, w in enumerate(weights):
            if w:
                terms.append(Term(z, whole(divisor * w), whole(j * step * (1 << bits)), ends, polynomials))
    return Sum(whole(q.offset * divisor * scale), tuple(terms), divisor * scale)


def values_at(subject: Subject, rows: Sequence[Functional], t: Fraction) -> list[Fraction]:
    """Return the value of each of the `rows`, weighted sums of shifted signals, at the time t [s]."""
    step, known = Fraction(subject.system.sampling_time), dict[tuple[int, int], Fraction]()
    for s, j in {term for row in rows for term in shifts_of(row)}:
        z = subject.pieces[s]
        i, local, _ = place(z, z.ends, t + j * step, Fraction(0))
        known[s, j] = Fraction(0)
        for c in reversed(z.coefficients[i]):  # Horner's rule
            known[s, j] = short(known[s, j] * local + Fraction(c))
    return [exact_sum([row.offset, *(row.weights[s][j] * known[s, j] for s, j in shifts_of(row))]) for row in rows]


def bits_of(numbers: Iterable[float | Fraction]) -> int:
    """Return the least e such that 2^e times each number is an integer; denominators must be powers of two."""
    return max((number.as_integer_ratio()[1] for number in numbers), default=1).bit_length() - 1


def _whole_polynomial(piece: Sequence[float], digits: int, bits: int) -> list[int]:
    tick()
    return [_scale(c, digits - bits * k) for k, c in enumerate(piece)]


def _scale(number: float, digits: int) -> int:
    numerator, denominator = number.as_integer_ratio()
    return numerator << (digits + 1 - denominator.bit_length())  # units are chosen so that this is exact


def whole(number: Fraction) -> int:
    """Return a number, which has to be an integer, as an int."""
    assert number.denominator == 1, "units are chosen so"
    return number.numerator


UNIT, _TINY = Fraction(1, 2**53), Fraction(1, 2**300)
_LARGEST, _SMALLEST, _LARGEST_POWER, _HIGHEST = 10**30, Fraction(1, 10**30), 10**100, 50


def check_sizes(certificate: Certificate) -> str | None:
    """Return why a number may be too large or too small for float64 evaluation; None if all numbers will do.

    With such a number, evaluation could overflow, or a factor could be lost by underflow.
    """
    subject = certificate.subject
    positive = [Fraction(subject.system.sampling_time)]
    lengths = {times: z.lengths for times, z in {z.breakpoints: z for z in subject.pieces}.items()}  # each once
    longest = {times: max([*each, Fraction(1)]) for times, each in lengths.items()}
    for z in subject.pieces:
        largest = max(map(abs, (*z.breakpoints, *(c for piece in z.coefficients for c in piece))))
        if largest > _LARGEST or z.degree > _HIGHEST or longest[z.breakpoints] ** z.degree > _LARGEST_POWER:
            return "sizes: some number of a piece is too large for the analysis of rounding"
    positive += [length for each in lengths.values() for length in each]
    for bound in subject.bounds:
        weights, offset = gross_of(bound.row, functionals(subject, bound.of))
        positive += [size for size in (*weights, offset) if size]
    if max(positive) > _LARGEST or min(positive) < _SMALLEST or certificate.until > 1e60:
        return "sizes: some number is too large or too small for the analysis of rounding"
    return None


def check_rounding(certificate: Certificate) -> str | None:
    """Return a sentence about the first bound whose quantity may have a larger rounding error than stated, or None."""
    if reason := _why_uncounted(certificate):
        return reason
    for name, error in evaluation_errors(certificate.subject, *_span(certificate)).items():
        if error > Fraction(certificate.errors[name]):
            stated = certificate.errors[name]
            return OfBound(name, f"evaluation: the {name} can be off by more than {stated!r} in float64")
    return None


def evaluation_errors(subject: Subject, start: Fraction, end: Fraction) -> dict[str, Fraction]:
    """Over-estimate the rounding error of each bounded quantity from `start` to `end` [s].

    States and inputs are evaluated in double-double arithmetic, at times that are not rounded, and rounded to float64
    once. So Σ_i r_i x_i with p weights r_i ≠ 0 takes one rounding of each x_i, p products and p − 1 sums, of numbers
    bounded by Σ_i |r_i x_i| in total, and one rounding of each r_i. Operations of double-double arithmetic have errors
    of at most 8 u² times the sum of the absolute terms: two for each power of the time since a breakpoint, which itself
    has an error of 80 u², and two for each shifted signal, whose weight has an error of u². All of this is to first
    order, and enlarged by 1 %.
    """
    largest = [
        _largest(subject, shifted_signal(subject, s, 0, 1), z.ends[0], z.ends[-1]) for s, z in enumerate(subject.pieces)
    ]
    shifted = sum(map(len, functionals(subject, "input")[0].weights))
    operations = 96 * (max(z.degree for z in subject.pieces) + 1) + 17 * (shifted + 1)
    found = dict[str, Fraction]()
    for bound in subject.bounds:
        weights, offset = gross_of(bound.row, functionals(subject, bound.of))
        gross = exact_sum([offset, *(w * size for w, size in zip(weights, largest, strict=True) if w)])
        used = sum(1 for r in bound.row if r)
        error = (used + 2) * UNIT * _size(subject, start, end, bound) + operations * UNIT**2 * gross
        found[bound.name] = Fraction(101, 100) * error + _TINY * (1 + exact_sum(weights))
    return found


def _why_uncounted(certificate: Certificate) -> str | None:
    """Return why periods may not be counted in float64 up to the last claimed time; None if they are."""
    shifts = max(len(weights) for part in functionals(certificate.subject, "input") for weights in part.weights)
    ahead = shifts * Fraction(certificate.subject.system.sampling_time)
    for z in certificate.subject.pieces:
        if z.beyond == "period" and not Fraction(certificate.until) + ahead + abs(z.ends[0]) <= 2**50 * z.period:
            return "evaluation: there are more periods than float64 can count"
    return None


def _size(subject: Subject, start: Fraction, end: Fraction, bound: Bound) -> Fraction:
    """Over-estimate Σ_i |r_i x_i| from `start` to `end` [s].

    If the row has only one state or input, the row's bounds are used. A later step proves them without these errors.
    """
    used = [(r, part) for r, part in zip(bound.row, functionals(subject, bound.of), strict=True) if r]
    if len(used) == 1:
        return max(map(abs, hull(bound)))
    return exact_sum(abs(r) * _largest(subject, part, start, end) for r, part in used)


def _largest(subject: Subject, row: Functional, start: Fraction, end: Fraction) -> Fraction:
    """Over-estimate the size of a row from `start` to `end` [s], by the absolute coefficients in each cell."""
    cells, bits = _cells(subject, row, start, end)
    q = whole_sum(subject, row, bits)
    return Fraction(max(sum(map(abs, q.polynomial(a, b - a))) for a, b in cells), q.unit)


def _span(certificate: Certificate) -> tuple[Fraction, Fraction]:
    assert not isinstance(certificate.proof, Steps), "refused before"
    return Fraction(certificate.proof.start), Fraction(certificate.proof.end)


def check_signals(subject: Subject) -> str | None:
    """Return which signal is invalid, or why there can be no proof about pieces; None if all are valid."""
    if not isinstance(subject.system, LinearSystem):
        return "pieces: states and inputs of polynomial pieces are checked for linear systems only"
    return next((reason for z in subject.pieces if (reason := why_no_signal(z))), None)


def check_pieces(certificate: Certificate, first_pass: FirstPass = NO_FIRST_PASS) -> str | None:
    """Return why a step of the proof fails for signals of polynomial pieces; None if all steps hold."""
    return (
        _claim_gap(certificate)
        or check_sizes(certificate)
        or check_rounding(certificate)
        or _positive(certificate, first_pass)
    )


def _claim_gap(certificate: Certificate) -> str | None:
    """Return why the claim does not follow from the cells; None if it does."""
    proof, pieces = certificate.proof, certificate.subject.pieces
    if isinstance(proof, Steps):
        return "claim: polynomial pieces are proved at all times of a claim, never at sampled instants alone"
    bounds = [end for bound in certificate.subject.bounds for end in (bound.low, bound.high)]
    pieces = (*pieces, *(end for end in bounds if isinstance(end, Pieces)))
    start, end = proof.start, proof.end
    match certificate.claim:
        case AllTimes():
            if not all(z.beyond == "rest" and z.breakpoints[-1] <= end for z in pieces):
                return f"claim: a signal is not at rest from {end!r} s on"
        case AllPhases():
            if not all(z.beyond == "period" and z.period == Fraction(end) for z in pieces):
                return f"period: a signal does not repeat after {end!r} s"
        case _:
            if not start < end:
                return f"claim: a window needs start < end, got {start!r} s and {end!r} s"
            return why_unknown(certificate.subject, Fraction(start), Fraction(end))
    return None


def why_unknown(subject: Subject, start: Fraction, end: Fraction) -> str | None:
    """Return which signal is undefined at some time on which states and inputs depend; None if all are defined."""
    for s, z in enumerate(subject.pieces):
        shifts = len(functionals(subject, "input")[0].weights[s]), len(functionals(subject, "state")[0].weights[s])
        ahead = (max(shifts) - 1) * Fraction(subject.system.sampling_time)
        if z.beyond == "end" and not (z.ends[0] <= start and end + ahead <= z.ends[-1]):
            return f"claim: signal {s} ends before the last time on which inputs until {float(end)!r} s depend"
    return None


def value_of_pieces(subject: Subject, bound: Bound, t: Fraction) -> Fraction:
    """Return the value of a bound's row at a time [s]. Raise UndefinedError if a signal is undefined there."""
    if reason := why_unknown(subject, t, t):
        raise UndefinedError(reason)
    return values_at(subject, [weighted_sum(bound.row, functionals(subject, bound.of))], t)[0]


def _positive(certificate: Certificate, first_pass: FirstPass) -> str | None:
    """Return a sentence about the first bound that is not shown to hold in all cells; None if all are."""
    subject, span = certificate.subject, _span(certificate)
    broken, alike = list[int](), dict[object, list[tuple[int, _Side]]]()
    for i, bound in enumerate(subject.bounds):
        for side in tightened_rows(subject, bound, Fraction(certificate.errors[bound.name])):
            alike.setdefault(_changes(*side[:2]), []).append((i, side))
    for k, sides in enumerate(alike.values()):
        progress(k, len(alike))
        of, row, _ = sides[0][1]
        cells, bits = _cells(of, row, *span)
        left = first_pass.cells_left(of, [(row, *ends) for _, (_, row, ends) in sides], cells, bits)
        some = zip(sides, left, strict=True)
        broken += [i for (i, (_, row, ends)), open_ in some if open_ and not _is_kept(of, row, ends, open_, bits)]
    if not broken:
        return None
    name = subject.bounds[min(broken)].name
    return OfBound(name, f"cell: the {name} is not shown to stay inside its bounds")


_Side = tuple[Subject, Functional, tuple[Fraction, Fraction]]
"""A row of signals, and two numbers between which it has to stay."""


def _changes(subject: Subject, row: Functional) -> object:
    """Return a key that is equal for rows of the same signals with equal breakpoints, which have the same cells."""
    used = {(subject.pieces[s].breakpoints, subject.pieces[s].beyond, j) for s, j in shifts_of(row)}
    return len(subject.pieces), id(subject.pieces[-1]), frozenset(used)


def keeps(subject: Subject, row: Functional, times: tuple[float, float], ends: tuple[Fraction, Fraction]) -> bool:
    """Return whether a row is shown to stay between two numbers, its `ends`, from the first to the last time [s].

    The denominators of `ends` must be powers of two.
    """
    return _is_kept(subject, row, ends, *_cells(subject, row, *map(Fraction, times)))


def tightened_rows(subject: Subject, bound: Bound, error: Fraction) -> Iterator[_Side]:
    """Yield the subject, the row of a bound, and the two numbers between which the row has to stay.

    These are the ends of the bound, tightened by an error. If an end moves in time, both ends are yielded separately.
    Then the difference of row and end has to stay on its side of zero, and at least the error away from zero. A moving
    end is one more signal of the subject. The number on the other side is so far away that it excludes nothing.
    """
    row = weighted_sum(bound.row, functionals(subject, bound.of))
    if not bound.moves:
        yield subject, row, (Fraction(bound.lower) + error, Fraction(bound.upper) - error)
        return
    low, high = hull(bound)
    far = Fraction(1 << (2 + ceil(high - low)).bit_length())
    for end, ends in ((bound.low, (error, far)), (bound.high, (-far, -error))):
        if isinstance(end, Pieces):
            more = replace(subject, pieces=(*subject.pieces, end))
            yield more, replace(row, weights=(*row.weights, (Fraction(-1),))), ends
        else:
            yield subject, replace(row, offset=row.offset - Fraction(end)), ends


def _cells(subject: Subject, row: Functional, start: Fraction, end: Fraction) -> tuple[Cells[int], int]:
    """Cut the time from start to end [s] at all breakpoints of the shifted signals in a row.

    Return the cells in between, and `bits`: the ends of cells are whole multiples of 2^−bits s.
    """
    step, used = Fraction(subject.system.sampling_time), shifts_of(row)
    signals = {s: subject.pieces[s] for s, _ in used}
    bits = max(bits_of([step, start, end]), bits_of(t for z in signals.values() for t in z.breakpoints))
    unit, ends = 1 << bits, {s: exact_times(z, bits) for s, z in signals.items()}
    terms = [(signals[s], ends[s], whole(j * step * unit)) for s, j in used]
    return cells_of(terms, whole(start * unit), whole(end * unit)), bits


def exact_times(z: Pieces, bits: int) -> list[int]:
    """Return the breakpoints in units of 2^−`bits` s."""
    return [_scale(t, bits) for t in z.breakpoints]


def _is_kept(
    subject: Subject,
    row: Functional,
    ends: tuple[Fraction, Fraction],
    cells: Sequence[tuple[int, int]],
    bits: int,
) -> bool:
    """Return whether a row stays between its ends in cells, whose times are in units of 2^−`bits` s."""
    q = whole_sum(subject, row, bits, ends)
    bottom, top = (whole(end * q.unit) for end in ends)
    for a, b in cells:
        tick()
        if not stays_between(q.polynomial(a, b - a), bottom, top):
            return False
    return True
