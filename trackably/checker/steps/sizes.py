"""Before step 5 of the proof: all numbers have sizes for which the analysis of rounding holds."""

from fractions import Fraction

from trackably.checker.arithmetic.intervals import at_most
from trackably.checker.certificate import Certificate
from trackably.checker.formulas.formula import numbers
from trackably.checker.steps.quantities import Quantity
from trackably.checker.subject import NonlinearSystem


def check_sizes(certificate: Certificate, quantities: list[Quantity]) -> str | None:
    """Verify that no number is so large, or so small, that float64 evaluation could overflow or lose a factor."""
    values: list[float] = []
    positive: list[float] = [certificate.subject.system.sampling_time]
    for signal in certificate.subject.signals:
        values += [*signal.centres, *signal.weights, signal.mean]
        positive += signal.kernel.numbers
    positive += [
        float(min(max(factor, Fraction(1, 10**40)), Fraction(10**40))) for factor in _factors(certificate, quantities)
    ]
    if max(map(abs, [*values, *positive])) > 1e30 or min(positive) < 1e-30:
        return "sizes: some number is too large or too small for the analysis of rounding"
    if certificate.until > 1e60 or not all(
        at_most(signal.kernel.peak.size, 1e100) for signal in certificate.subject.signals
    ):
        return "sizes: some value could overflow in float64 evaluation"
    return None


def _factors(certificate: Certificate, quantities: list[Quantity]) -> list[Fraction]:
    """Return all factors other than zero that occur in float64 evaluation."""
    arguments = [argument for q in quantities for argument in q.arguments.values()]
    factors = [size for argument in arguments for size in (*argument.gross, argument.gross_offset)]
    factors += [abs(r) for q in quantities for r, _ in q.parts]
    if isinstance(certificate.subject.system, NonlinearSystem):
        factors += [abs(Fraction(v)) for formula in certificate.subject.system.f for v in numbers(formula)]
    return [factor for factor in factors if factor]
