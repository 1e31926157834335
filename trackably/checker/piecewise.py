"""A weighted sum of shifted signals is one polynomial between any two of their shifted breakpoints: its cells.

All float64 numbers are whole multiples of a power of two. So times are counted in units of 2^−e s, and values in such
units that every polynomial has whole coefficients.

Polynomials with whole coefficients that are nowhere negative on [0, 1].

The rounding errors of evaluating polynomial pieces are at most the stated errors.

The steps of a proof about polynomial pieces, and those of a counterexample.
"""

from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise

from trackably.checker.certificate import AllPhases, AllTimes, Certificate, Claim, Instants
from trackably.checker.counterexample import Counterexample
from trackably.checker.counterexample import Instants as AtStep
from trackably.checker.intervals import common_denominator, exact_sum
from trackably.checker.limits import CELLS
from trackably.checker.quantities import functionals
from trackably.checker.redundancy import demanded
from trackably.checker.subject import Bound, Functional, LinearSystem, Pieces, Subject, why_no_signal
from trackably.checker.watch import UndecidedError, progress, require_room, tick


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


_MOST_CUTS = 2000


def is_nowhere_negative(a: Sequence[int]) -> bool:
    """Return whether Σ a_k x^k ≥ 0 for all x ∈ [0, 1].

    With x = y/(1 + y), (1 + y)ⁿ p(x) = Σ a_k y^k (1 + y)^(n − k): where all coefficients of this polynomial in y ≥ 0
    are ≥ 0, p is nowhere negative. Where some are not, [0, 1] is halved; a negative value at an end refutes it.
    """
    waiting = [list(a)]
    for _ in range(_MOST_CUTS):
        if not waiting:
            return True
        tick()
        p = waiting.pop()
        if p[0] < 0 or sum(p) < 0:
            return False
        if all(c >= 0 for c in _moved(p[::-1])):
            continue
        n = len(p) - 1
        half = [c << (n - k) for k, c in enumerate(p)]  # 2ⁿ p(x/2)
        waiting += [half, _moved(half)]
    return False


def _moved(p: Sequence[int]) -> list[int]:
    """Return the coefficients of p(x + 1)."""
    found = list(p)
    for i in range(len(found) - 1):
        for k in range(len(found) - 2, i - 1, -1):
            found[k] += found[k + 1]
    return found


UNIT, _TINY = Fraction(1, 2**53), Fraction(1, 2**300)
_LARGEST, _SMALLEST, _LARGEST_POWER, _HIGHEST = 10**30, Fraction(1, 10**30), 10**100, 50


def check_sizes(certificate: Certificate) -> str | None:
    """Verify that no number is so large, or so small, that float64 evaluation could overflow or lose a factor."""
    subject = certificate.subject
    positive = [Fraction(subject.system.sampling_time)]
    for z in subject.pieces:
        largest = max(map(abs, (*z.breakpoints, *(c for piece in z.coefficients for c in piece))))
        if largest > _LARGEST or z.degree > _HIGHEST or max([*z.lengths, Fraction(1)]) ** z.degree > _LARGEST_POWER:
            return "sizes: some number of a piece is too large for the analysis of rounding"
        positive += z.lengths
    for bound in subject.bounds:
        weights, offset = _gross(subject, bound)
        positive += [size for size in (*weights, offset) if size]
    if max(positive) > _LARGEST or min(positive) < _SMALLEST or certificate.until > 1e60:
        return "sizes: some number is too large or too small for the analysis of rounding"
    return None


def check_rounding(certificate: Certificate) -> str | None:
    """Return the first bound whose quantity can be off by more than the stated error."""
    if reason := _why_uncounted(certificate):
        return reason
    for name, error in evaluation_errors(certificate.subject, certificate.claim).items():
        if error > Fraction(certificate.errors[name]):
            return f"evaluation: the {name} can be off by more than {certificate.errors[name]!r} in float64"
    return None


def evaluation_errors(subject: Subject, claim: Claim) -> dict[str, Fraction]:
    """Over-estimate the rounding error of each bounded quantity at the times of a claim.

    States and inputs are evaluated in double-double arithmetic, at times that are not rounded, and rounded to float64
    once. So Σ_i r_i x_i with p weights r_i ≠ 0 takes one rounding of each x_i, p products and p − 1 sums, of numbers
    that are no larger than Σ_i |r_i x_i| together, and one of each r_i. Operations of double-double arithmetic are off
    by 8 u² of the sum of the absolute terms, as if none cancelled: two for each power of the time since a breakpoint,
    which is off by 80 u² itself, and two for each shifted signal, whose weight is off by u². All of this is to first
    order, and enlarged by 1 %.
    """
    largest = [max(map(_absolute_terms, z.lengths, z.coefficients)) for z in subject.pieces]
    shifted = sum(map(len, functionals(subject, "input")[0].weights))
    operations = 96 * (max(z.degree for z in subject.pieces) + 1) + 17 * (shifted + 1)
    found = dict[str, Fraction]()
    for bound in subject.bounds:
        weights, offset = _gross(subject, bound)
        gross = exact_sum([offset, *(w * size for w, size in zip(weights, largest, strict=True))])
        used = sum(1 for r in bound.row if r)
        error = (used + 2) * UNIT * _size(subject, claim, bound) + operations * UNIT**2 * gross
        found[bound.name] = Fraction(101, 100) * error + _TINY * (1 + exact_sum(weights))
    return found


def _why_uncounted(certificate: Certificate) -> str | None:
    """Return why periods may not be counted in float64 until the last time that is claimed; None where they are."""
    shifts = max(len(weights) for part in functionals(certificate.subject, "input") for weights in part.weights)
    ahead = shifts * Fraction(certificate.subject.system.sampling_time)
    for z in certificate.subject.pieces:
        if z.beyond == "period" and not Fraction(certificate.until) + ahead + abs(z.ends[0]) <= 2**50 * z.period:
            return "evaluation: there are more periods than float64 can count"
    return None


def _gross(subject: Subject, bound: Bound) -> tuple[list[Fraction], Fraction]:
    """Return the sums of the absolute weights of each signal, and of the absolute offsets, as if nothing cancelled."""
    pairs = list(zip(bound.row, functionals(subject, bound.of), strict=True))
    weights = [exact_sum(abs(r * w) for r, part in pairs for w in part.weights[s]) for s in range(len(subject.pieces))]
    return weights, exact_sum(abs(r * part.offset) for r, part in pairs)


def _absolute_terms(length: Fraction, coefficients: Sequence[float]) -> Fraction:
    """Return Σ_j |c_j| hʲ, which no value in a piece of this length h exceeds."""
    return exact_sum(abs(Fraction(c)) * length**j for j, c in enumerate(coefficients))


def _size(subject: Subject, claim: Claim, bound: Bound) -> Fraction:
    """Over-estimate Σ_i |r_i x_i| at all times of the claim: by the absolute coefficients in each cell.

    Of a single state or input, it is inside the bounds: a later step proves this without any use of errors.
    """
    total = Fraction(0)
    if sum(1 for r in bound.row if r) == 1:
        return max(abs(Fraction(end)) for end in (bound.lower, bound.upper))
    assert not isinstance(claim, Instants), "refused before"
    start, end = map(Fraction, claim.span)
    for r, part in zip(bound.row, functionals(subject, bound.of), strict=True):
        if r:
            q = whole_sum(subject, (r,), (part,), [start, end])
            cells = q.cells(int(start * (1 << q.bits)), int(end * (1 << q.bits)))
            total += Fraction(max(sum(map(abs, cell)) for cell in cells), q.unit)
    return total


def check_signals(subject: Subject) -> str | None:
    """Return which signal is none, or why there can be no proof about pieces; None where all are signals."""
    if not isinstance(subject.system, LinearSystem):
        return "pieces: states and inputs of polynomial pieces are checked for linear systems only"
    return next((reason for z in subject.pieces if (reason := why_no_signal(z))), None)


def check_pieces(certificate: Certificate) -> str | None:
    """Return the first step that fails; None where everything is shown."""
    return (
        _names(certificate)
        or _claimed(certificate)
        or check_sizes(certificate)
        or check_rounding(certificate)
        or _positive(certificate)
    )


def _names(certificate: Certificate) -> str | None:
    bounded = [bound.name for bound in certificate.subject.bounds]
    if not bounded:
        return "names: nothing is bounded"
    if len(set(bounded)) != len(bounded) or sorted(certificate.errors) != sorted(bounded):
        return "names: evaluation errors must have the names of the bounds, each once"
    return None


def _claimed(certificate: Certificate) -> str | None:
    """Return why the claim does not follow from what holds in the cells; None where it does."""
    claim, pieces = certificate.claim, certificate.subject.pieces
    match claim:
        case Instants():
            return "claim: of polynomial pieces, instants are not claimed alone"
        case AllTimes(tail_start):
            if not all(z.beyond == "rest" and z.breakpoints[-1] <= tail_start for z in pieces):
                return f"claim: a signal is not at rest from {tail_start!r} s on"
        case AllPhases(period):
            if not all(z.beyond == "period" and z.period == Fraction(period) for z in pieces):
                return f"period: a signal does not repeat after {period!r} s"
        case _:
            start, end = claim.span
            if not start < end:
                return f"claim: the window from {start!r} s to {end!r} s is none"
            return why_unknown(certificate.subject, Fraction(start), Fraction(end))
    return None


def why_unknown(subject: Subject, start: Fraction, end: Fraction) -> str | None:
    """Return which signal says nothing at some time on which states and inputs depend; None where all say enough."""
    for s, z in enumerate(subject.pieces):
        shifts = len(functionals(subject, "input")[0].weights[s]), len(functionals(subject, "state")[0].weights[s])
        ahead = (max(shifts) - 1) * Fraction(subject.system.sampling_time)
        if z.beyond == "end" and not (z.ends[0] <= start and end + ahead <= z.ends[-1]):
            return f"claim: signal {s} ends before the last time on which inputs until {float(end)!r} s depend"
    return None


def _positive(certificate: Certificate) -> str | None:
    """Return the first bound that is not shown to be kept in each cell."""
    subject, claim = certificate.subject, certificate.claim
    assert not isinstance(claim, Instants), "refused before"
    start, end = map(Fraction, claim.span)
    for i, bound in enumerate(subject.bounds):
        progress(i, len(subject.bounds))
        error = Fraction(certificate.errors[bound.name])
        low, high = Fraction(bound.lower) + error, Fraction(bound.upper) - error
        q = whole_sum(subject, bound.row, functionals(subject, bound.of), [start, end], [low, high])
        bottom, top = int(low * q.unit), int(high * q.unit)
        for first, *others in q.cells(int(start * (1 << q.bits)), int(end * (1 << q.bits))):
            above, below = [first - bottom, *others], [top - first, *(-c for c in others)]
            if not (is_nowhere_negative(above) and is_nowhere_negative(below)):
                return f"cell: the {bound.name} is not shown to stay inside its bounds"
    return None


def check_violation(counterexample: Counterexample) -> str | None:
    """Return why the counterexample shows nothing; None where it refutes what is claimed."""
    subject, where = counterexample.subject, counterexample.where
    if isinstance(where, AtStep):
        t = where.step * Fraction(subject.system.sampling_time)
    else:
        t = Fraction(where.time)
        if not where.start <= where.time <= where.end:
            return f"at: {where.time!r} s is no time of the claim"
    bound = next((bound for bound in subject.bounds if bound.name == counterexample.name), None)
    if bound is None:
        return f"quantity: no bound is called {counterexample.name}"
    ends = _necessary(subject, bound)
    if ends is None:
        return f"attainable: the rows of the input set do not demand the bound of {bound.name}"
    by, value = Fraction(counterexample.violation), value_at(subject, bound.row, functionals(subject, bound.of), t)
    if value + by <= ends[0] or ends[1] + by <= value:
        return why_unknown(subject, t, t)
    return f"value: the {bound.name} is not outside of its bounds by {counterexample.violation!r}"


def _necessary(subject: Subject, bound: Bound) -> tuple[Fraction, Fraction] | None:
    """Return between which values a row has to stay: of redundant inputs, what the rows of U together demand."""
    if bound.of == "state" or not isinstance(subject.system, LinearSystem):
        return Fraction(bound.lower), Fraction(bound.upper)
    return demanded(subject.system, subject.input_set.rows, bound)
