"""Bounded quantities of a reference as exact real functions of time, defined by the stored numbers alone."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import lru_cache

from flint import arb

from trackable.certificates.balls.arithmetic import ball_arithmetic
from trackable.certificates.balls.formulas import at_balls, require
from trackable.certificates.kernels.table import balls_of
from trackable.gp.factors.cached import cached
from trackable.gp.signal import KernelSum
from trackable.systems.flat.functional import Functional
from trackable.systems.flat.requirements import Requirement
from trackable.systems.flat.shifted import shifted
from trackable.systems.formulas.expression import Expression, variables
from trackable.systems.reference import Reference
from trackable.systems.sets.interval import Interval


@dataclass(frozen=True, eq=False)
class ShiftedSignal:
    """z(t + s) − m = Σ_i c_i κ(t + s − t_i), with z the `signal` and s the `shift` [s].

    Quantities share these objects, so that each shifted signal is enclosed once for all quantities.
    """

    signal: KernelSum
    shift: arb

    @cached
    def summands(self) -> list[tuple[arb, arb]]:
        """All s − t_i and c_i."""
        with ball_arithmetic():
            pairs = zip(self.signal.centres.tolist(), self.signal.weights.tolist(), strict=True)
            return [(self.shift - arb(t_i), arb(c)) for t_i, c in pairs]

    def at(self, t: arb) -> arb:
        """Enclose z(t + s) − m."""
        with ball_arithmetic():
            kernel = balls_of(self.signal.kernel)
            return sum((c * kernel.value(t + shift) for shift, c in self.summands), arb(0))


@dataclass(frozen=True)
class ExactFunctional:
    """q(t) = offset + Σ_j w_j (z_j(t + s_j) − m_j), with pairs (w_j, shifted signal) in `terms`.

    `offset` is the value at rest. The weights enclose the exact weights: 1/b is a ball, not a rounded quotient.
    """

    terms: tuple[tuple[arb, ShiftedSignal], ...]
    offset: arb

    def at(self, t: arb) -> arb:
        """Enclose q(t)."""
        with ball_arithmetic():
            return self.offset + sum((weight * shifted.at(t) for weight, shifted in self.terms), arb(0))


@dataclass(frozen=True)
class ExactQuantity:
    """A `formula` of the functionals in `arguments` (by name), which has to stay in `bounds`.

    What `needs` say of the arguments has to hold too: one quantity of a reference with a flat form takes this on.
    """

    name: str
    formula: Expression
    arguments: Mapping[str, ExactFunctional]
    bounds: Interval
    needs: tuple[Requirement, ...] = ()

    @property
    def shifted_signals(self) -> tuple[ShiftedSignal, ...]:
        """All shifted signals on which the quantity depends."""
        return tuple(shifted for functional in self.arguments.values() for _, shifted in functional.terms)

    def at(self, t: arb) -> arb:
        """Enclose q(t). UndefinedError where it may not be defined, or where it lacks what it needs."""
        with ball_arithmetic():
            values = {name: functional.at(t) for name, functional in self.arguments.items()}
            require(self.needs, values)
            return at_balls(self.formula, values)

    def margin_at(self, t: arb) -> arb:
        """Enclose the distance to the nearer bound: certainly negative where a bound is certainly broken."""
        with ball_arithmetic():
            q = self.at(t)
            return (q - arb(self.bounds.lower)).min(arb(self.bounds.upper) - q)


@lru_cache(4)  # a proof asks more than once
def exact_quantities(reference: Reference) -> tuple[ExactQuantity, ...]:
    """Return all bounded quantities."""
    known: dict[tuple[int, int], ShiftedSignal] = {}
    found = [
        ExactQuantity(
            quantity.name,
            quantity.trajectory.formula,
            {name: _exact(reference, functional, known) for name, functional in quantity.trajectory.arguments},
            quantity.bounds,
        )
        for quantity in reference.quantities
    ]
    form, needs = reference.plant.flat_form, reference.plant.needs
    if found and form is not None:
        names = {name for needed in needs for name in variables(needed.formula)}
        functionals = shifted(form, reference.plant.sampling_time)
        more = {name: _exact(reference, functionals[name], known) for name in sorted(names)}
        found[-1] = replace(found[-1], arguments={**more, **found[-1].arguments}, needs=needs)
    return tuple(found)


def _exact(
    reference: Reference, functional: Functional, known: dict[tuple[int, int], ShiftedSignal]
) -> ExactFunctional:
    """Return an exact functional. Take shifted signals from `known`; add new ones to it."""
    with ball_arithmetic():
        terms = []
        for c, weights in enumerate(functional.weights):
            for j, w in enumerate(weights):
                if w:
                    new = ShiftedSignal(reference.kernel_sums[c], j * arb(functional.sampling_time))
                    terms.append((rational(w), known.setdefault((c, j), new)))
        at_rest = rational(functional.offset) + sum((w * arb(shifted.signal.mean) for w, shifted in terms), arb(0))
    return ExactFunctional(tuple(terms), at_rest)


def rational(number: Fraction) -> arb:
    """Return a ball around a rational number."""
    return arb(number.numerator) / arb(number.denominator)
