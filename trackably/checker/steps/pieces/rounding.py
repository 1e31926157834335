"""The rounding errors of evaluating polynomial pieces are at most the stated errors."""

from collections.abc import Sequence
from fractions import Fraction

from trackably.checker.arithmetic.intervals import exact_sum
from trackably.checker.certificate import Certificate, Claim, Instants
from trackably.checker.steps.pieces.cells import whole_sum
from trackably.checker.steps.quantities import functionals
from trackably.checker.subject import Bound, Subject

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
