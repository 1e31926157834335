"""A reference's bounded quantities as exact real functions of time, defined by the stored numbers alone."""

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction

from flint import arb

from pipeline.certificates.balls import ball_arithmetic
from pipeline.certificates.growth import beyond
from pipeline.certificates.series import value
from pipeline.gp.signal import KernelSum
from pipeline.systems.interval import Interval
from pipeline.systems.quantity import Quantity
from pipeline.systems.reference import Reference


@dataclass(frozen=True)
class Term:
    """w (z(t + s) − m) with z − m = Σ_i c_i κ(t − t_i): one look at a `signal`, `weight` w, `shift` s [s]."""

    signal: KernelSum
    weight: arb
    shift: arb

    @property
    def pairs(self) -> list[tuple[float, float]]:
        """(t_i, c_i) of the signal."""
        return list(zip(self.signal.centres.tolist(), self.signal.weights.tolist(), strict=True))


@dataclass(frozen=True)
class ExactQuantity:
    """q(t) = offset + Σ_j w_j (z_j(t + s_j) − m_j), wanted in `bounds`; offset is its value at rest.

    The weights are those of the formulas, not of their float64 evaluation: 1/b is a ball, no rounded quotient.
    """

    name: str
    terms: tuple[Term, ...]
    offset: arb
    bounds: Interval

    def summands(self) -> Iterator[tuple[Term, arb, arb]]:
        """All w c κ(t + s − t_i): the term, s − t_i and w c."""
        for term in self.terms:
            for t_i, c in term.pairs:
                yield term, term.shift - arb(t_i), term.weight * arb(c)

    def at(self, t: arb) -> arb:
        """Enclosure of q(t)."""
        with ball_arithmetic():
            return self.offset + sum(
                (weight * value(term.signal.kernel, t + shift) for term, shift, weight in self.summands()), arb(0)
            )

    def margin_at(self, t: arb) -> arb:
        """Enclosure of the distance to the nearer bound: certainly negative where a bound is certainly broken."""
        with ball_arithmetic():
            q = self.at(t)
            return (q - arb(self.bounds.lower)).min(arb(self.bounds.upper) - q)


def exact_quantities(reference: Reference) -> tuple[ExactQuantity, ...]:
    """Everything that is bounded."""
    return tuple(_exact(reference, quantity) for quantity in reference.quantities)


def _exact(reference: Reference, quantity: Quantity) -> ExactQuantity:
    functional = quantity.functional
    with ball_arithmetic():
        terms = tuple(
            Term(signal, rational(w), j * arb(functional.sampling_time))
            for signal, weights in zip(reference.signals, functional.weights, strict=True)
            for j, w in enumerate(weights)
            if w
        )
        at_rest = rational(functional.offset) + sum((term.weight * arb(term.signal.mean) for term in terms), arb(0))
    return ExactQuantity(quantity.name, terms, at_rest, quantity.bounds)


def rational(number: Fraction) -> arb:
    """A ball around a rational number."""
    return arb(number.numerator) / arb(number.denominator)


def limits_beyond(reference: Reference, start: arb) -> dict[str, tuple[arb, arb]]:
    """Centre and reach of an interval that holds each quantity for all real t ≥ `start` [s]: an over-estimate.

    With e = z − m: |e(t)| ≤ R = Σ |c_i| K_i and |ė(t)| ≤ D = Σ |c_i| D_i, where K_i and D_i bound |κ| and |κ̇| at all
    distances from start − t_i on. So Σ_j w_j e(t + j T_s) is at most Σ_j |w_j| R; and since it is
    Σ_j w_j e(t) + Σ_j w_j (e(t + j T_s) − e(t)), at most |Σ_j w_j| R + T_s Σ_j j |w_j| D.
    """
    with ball_arithmetic(2):
        envelopes = [_envelope(signal, start) for signal in reference.signals]
        limits = {}
        for quantity, exact in zip(reference.quantities, exact_quantities(reference), strict=True):
            reach = arb(0)
            for (size, rate), weights in zip(envelopes, quantity.functional.weights, strict=True):
                by_reach = rational(sum((abs(w) for w in weights), Fraction(0))) * size
                steps = rational(sum((j * abs(w) for j, w in enumerate(weights)), Fraction(0)))
                by_rate = rational(abs(sum(weights, Fraction(0)))) * size
                by_rate += arb(quantity.functional.sampling_time) * steps * rate
                reach += by_rate.min(by_reach)
            limits[quantity.name] = exact.offset, reach
        return limits


def _envelope(signal: KernelSum, start: arb) -> tuple[arb, arb]:
    reach, rate = arb(0), arb(0)
    for t_i, c in zip(signal.centres.tolist(), signal.weights.tolist(), strict=True):
        kappa, slope = beyond(signal.kernel, (start - arb(t_i)).max(arb(0)))
        reach += abs(arb(c)) * kappa
        rate += abs(arb(c)) * slope
    return reach, rate
