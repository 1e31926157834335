"""What a flat form needs beside its bounds, in each box, at each instant and in the tail: that formulas have values.

And step 5 of the proof for its formulas: their rounding errors depend on where the signals are, and are bounded there.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from trackable.checker.arithmetic.domains import UndefinedError
from trackable.checker.arithmetic.intervals import UNIT, ZERO, Real, at_most, exactly, ratio
from trackable.checker.arithmetic.models import Model, Models
from trackable.checker.certificate import Certificate
from trackable.checker.formulas.formula import evaluate, text
from trackable.checker.formulas.tracked import Tracked, TrackedFormulas
from trackable.checker.steps.quantities import Quantity
from trackable.checker.steps.rounding import TINY, errors_of_arguments

_LONGEST = 200


@dataclass(frozen=True)
class FlatNeeds:
    """What the quantities of a certificate need: errors of their arguments by name, and the roundings of a row."""

    stated: Mapping[str, float]
    of_arguments: Mapping[str, Mapping[str, Real]]
    roundings: int

    @classmethod
    def of(cls, certificate: Certificate, quantities: list[Quantity]) -> "FlatNeeds":
        """Return what these quantities need; nothing where none is of a flat form."""
        system = certificate.subject.system
        flat = [q for q in quantities if q.is_flat]
        errors = {q.name: found for q, found in zip(flat, errors_of_arguments(certificate, flat), strict=True)}
        return cls(certificate.errors, errors, len(system.states) + len(system.inputs) + 2)

    def require(self, q: Quantity, arguments: Mapping[str, Model], terms: int) -> None:
        """Raise UndefinedError where a need of a quantity may fail, or its rounding may exceed what is stated."""
        for need in q.needs:
            span = evaluate(need.formula, arguments, Models(terms)).span
            if not (span.a > 0 or (need.may_be_negative and span.b < 0)):
                what = "may be zero" if need.may_be_negative else "may not be positive"
                raise UndefinedError(f"{text(need.formula)[:_LONGEST]} {what}")
        if q.is_flat and not at_most(self._error(q, arguments, terms), self.stated[q.name]):
            raise UndefinedError(f"it can be off by more than {self.stated[q.name]!r} in float64")

    def _error(self, q: Quantity, arguments: Mapping[str, Model], terms: int) -> Real:
        values = {name: Tracked(model, self.of_arguments[q.name][name]) for name, model in arguments.items()}
        error, size = ZERO, ZERO
        for r, part in q.parts:
            found = evaluate(part, values, TrackedFormulas(terms))
            error, size = error + abs(ratio(r)) * found.error, size + abs(ratio(r)) * abs(found.computed)
        return exactly(1.01) * (error + self.roundings * UNIT * size) + TINY


def constants(values: Mapping[str, Real], terms: int) -> dict[str, Model]:
    """Return models of numbers."""
    return {name: Models(terms).number(value) for name, value in values.items()}
