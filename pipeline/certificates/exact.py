"""A reference's bounded quantities as exact real functions of time, defined by the stored numbers alone."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction

from flint import arb

from pipeline.certificates.balls import ball_arithmetic
from pipeline.certificates.formulas import at_balls
from pipeline.certificates.series import value
from pipeline.gp.signal import KernelSum
from pipeline.systems.expression import Expression
from pipeline.systems.functional import Functional
from pipeline.systems.interval import Interval
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
class ExactFunctional:
    """q(t) = offset + Σ_j w_j (z_j(t + s_j) − m_j); offset is its value at rest.

    The weights are those of the formulas, not of their float64 evaluation: 1/b is a ball, no rounded quotient.
    """

    terms: tuple[Term, ...]
    offset: arb

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


@dataclass(frozen=True)
class ExactQuantity:
    """A `formula` of functionals, by name in `arguments`, wanted in `bounds`."""

    name: str
    formula: Expression
    arguments: Mapping[str, ExactFunctional]
    bounds: Interval

    @property
    def terms(self) -> tuple[Term, ...]:
        """Every look at a signal."""
        return tuple(term for functional in self.arguments.values() for term in functional.terms)

    def at(self, t: arb) -> arb:
        """Enclosure of q(t). UndefinedError where it may not be defined."""
        with ball_arithmetic():
            return at_balls(self.formula, {name: functional.at(t) for name, functional in self.arguments.items()})

    def margin_at(self, t: arb) -> arb:
        """Enclosure of the distance to the nearer bound: certainly negative where a bound is certainly broken."""
        with ball_arithmetic():
            q = self.at(t)
            return (q - arb(self.bounds.lower)).min(arb(self.bounds.upper) - q)


def exact_quantities(reference: Reference) -> tuple[ExactQuantity, ...]:
    """Everything that is bounded."""
    return tuple(
        ExactQuantity(
            quantity.name,
            quantity.trajectory.formula,
            {name: _exact(reference, functional) for name, functional in quantity.trajectory.arguments},
            quantity.bounds,
        )
        for quantity in reference.quantities
    )


def _exact(reference: Reference, functional: Functional) -> ExactFunctional:
    with ball_arithmetic():
        terms = tuple(
            Term(signal, rational(w), j * arb(functional.sampling_time))
            for signal, weights in zip(reference.signals, functional.weights, strict=True)
            for j, w in enumerate(weights)
            if w
        )
        at_rest = rational(functional.offset) + sum((term.weight * arb(term.signal.mean) for term in terms), arb(0))
    return ExactFunctional(terms, at_rest)


def rational(number: Fraction) -> arb:
    """A ball around a rational number."""
    return arb(number.numerator) / arb(number.denominator)
