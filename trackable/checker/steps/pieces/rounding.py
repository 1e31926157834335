"""The rounding errors of evaluating polynomial pieces in float64 are at most the stated errors."""

from fractions import Fraction

from trackable.checker.certificate import Certificate
from trackable.checker.pieces import Pieces
from trackable.checker.steps.quantities import functionals
from trackable.checker.subject import Bound, Subject

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
    """Return the first bound whose quantity can be off by more than the stated error.

    To first order in u, enlarged by 1 %. k T, j T, t + j T, the phase of a period and the time since the breakpoint are
    rounded: all of this moves the time by 9 u times the sizes of the times at most. So z changes by its slope times
    this, and by a jump where it leads across a breakpoint, which can be one at most. Horner's rule of degree n takes
    2 n roundings of sums that are no larger than that of the absolute terms.
    """
    subject, found = certificate.subject, []
    shifts = max(len(weights) for part in functionals(subject, "input") for weights in part.weights)
    for z in subject.pieces:
        of_signal = _signal_error(z, Fraction(certificate.until), shifts * Fraction(subject.system.sampling_time))
        if isinstance(of_signal, str):
            return of_signal
        found.append(of_signal)
    roundings = 5 + sum(map(len, functionals(subject, "input")[0].weights)) + len(subject.system.states)
    roundings += len(subject.system.inputs)
    for bound in subject.bounds:
        weights, offset = _gross(subject, bound)
        pairs = list(zip(weights, found, strict=True))
        error = sum((w * e for w, (e, _) in pairs), Fraction(0))
        size = sum((w * s for w, (_, s) in pairs), offset)
        total = Fraction(101, 100) * (error + roundings * UNIT * size) + _TINY * (1 + sum(weights))
        if total > Fraction(certificate.errors[bound.name]):
            stated = certificate.errors[bound.name]
            return f"evaluation: the {bound.name} can be off by more than {stated!r} in float64"
    return None


def _gross(subject: Subject, bound: Bound) -> tuple[list[Fraction], Fraction]:
    """Return the sums of the absolute weights of each signal, and of the absolute offsets, as if nothing cancelled."""
    pairs = list(zip(bound.row, functionals(subject, bound.of), strict=True))
    weights = [
        sum((abs(r * w) for r, part in pairs for w in part.weights[s]), Fraction(0)) for s in range(len(subject.pieces))
    ]
    return weights, sum((abs(r * part.offset) for r, part in pairs), Fraction(0))


def _signal_error(z: Pieces, until: Fraction, ahead: Fraction) -> tuple[Fraction, Fraction] | str:
    """Over-estimate |float64 − exact| and |z|. A sentence, where rounding can lead further than beyond a piece."""
    farthest = max(abs(z.ends[0]), abs(z.ends[-1]))
    if z.beyond == "period":
        farthest = until + ahead + 2 * farthest + z.period
    moved = 9 * UNIT * (farthest + ahead)
    if 400 * (z.degree + 1) * moved > min(z.lengths):
        return "evaluation: a piece is so short that rounding a time can lead far beyond it"
    value, slope = Fraction(0), Fraction(0)
    for h, piece in zip(z.lengths, z.coefficients, strict=True):
        sizes = [abs(Fraction(c)) * h**j for j, c in enumerate(piece)]
        value = max(value, sum(sizes, Fraction(0)))
        slope = max(slope, sum((j * size for j, size in enumerate(sizes)), Fraction(0)) / h)
    lasts = [
        sum((Fraction(c) * h**j for j, c in enumerate(p)), Fraction(0))
        for h, p in zip(z.lengths, z.coefficients, strict=True)
    ]
    firsts = [Fraction(piece[0]) for piece in z.coefficients]
    met = zip(lasts, firsts[1:] + (firsts[:1] if z.beyond == "period" else []), strict=False)
    jump = max((abs(last - first) for last, first in met), default=Fraction(0))
    return (2 * z.degree + 4) * UNIT * value + moved * slope + jump, value
