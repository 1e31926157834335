"""What a flat form needs beside its bounds, in each box, at each instant and in the tail: that formulas have values.

And step 5 of the proof for its formulas: their rounding errors depend on where the signals are, and are bounded there.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

from trackably.checker.certificate import Certificate
from trackably.checker.formulas import Formula, evaluate, text
from trackably.checker.intervals import UNIT, ZERO, Real, either, exactly, ratio, required, total
from trackably.checker.models import Model, Models
from trackably.checker.quantities import ITSELF, Quantity
from trackably.checker.rounding import TINY, Tracked, TrackedFormulas, errors_of_arguments

_OUTER = 6


@dataclass(frozen=True)
class FlatNeeds:
    """What the quantities of a certificate need: rounding errors of shifted signals by name, and roundings of a row."""

    stated: Mapping[str, float]
    of_arguments: Mapping[str, Real]
    roundings: int

    @classmethod
    def of(cls, certificate: Certificate, quantities: list[Quantity]) -> "FlatNeeds":
        """Return what these quantities need; nothing where none is of a flat form."""
        system = certificate.subject.system
        arguments = {
            name: argument
            for q in quantities
            if q.is_flat or q.needs
            for name, argument in q.arguments.items()
            if name != ITSELF
        }
        errors = errors_of_arguments(certificate, arguments)
        return cls(certificate.errors, errors, len(system.states) + len(system.inputs) + 2)


@dataclass(frozen=True)
class FlatValues:
    """Values of the formulas of a flat form for some values of the shifted signals: each part is computed once."""

    needs: FlatNeeds
    terms: int
    known: dict[Formula, Tracked] = field(default_factory=dict)

    def enclose(self, q: Quantity, arguments: Mapping[str, Model]) -> Model:
        """Enclose a quantity. `arguments` are the same for all quantities that have them.

        Raise UndefinedError where a need of the quantity may fail, or its rounding may exceed what is stated.
        """
        tracked = self._tracked(arguments)
        for need in q.needs:
            span = self._of(need.formula, tracked).model.span
            what = "may be zero" if need.may_be_negative else "may not be positive"
            holds = either(span.a > 0, need.may_be_negative and span.b < 0)
            required(holds, f"{text(need.formula, _OUTER)} {what}")
        if not q.is_flat:
            return evaluate(q.formula, arguments, Models(self.terms))
        parts = self._parts(q, tracked)
        stated = self.needs.stated[q.name]
        required(self._error(parts).b <= stated, f"it can be off by more than {stated!r} in float64")
        found = Models(self.terms).number(ZERO)
        for r, part in parts:
            found += part.model.times(r)
        return found

    def error(self, q: Quantity, arguments: Mapping[str, Model]) -> Real:
        """Over-estimate the rounding error of a formula. Raise UndefinedError where it may not be defined."""
        return self._error(self._parts(q, self._tracked(arguments)))

    def _tracked(self, arguments: Mapping[str, Model]) -> dict[str, Tracked]:
        errors = self.needs.of_arguments
        return {name: Tracked(model, errors[name]) for name, model in arguments.items() if name in errors}

    def _parts(self, q: Quantity, tracked: Mapping[str, Tracked]) -> list[tuple[Real, Tracked]]:
        return [(ratio(r), self._of(part, tracked)) for r, part in q.parts]

    def _of(self, formula: Formula, values: Mapping[str, Tracked]) -> Tracked:
        return evaluate(formula, values, TrackedFormulas(self.terms), self.known)

    def _error(self, parts: list[tuple[Real, Tracked]]) -> Real:
        error = total(abs(r) * part.error for r, part in parts)
        size = total(abs(r) * abs(part.computed) for r, part in parts)
        return exactly(1.01) * (error + self.needs.roundings * UNIT * size) + TINY


def constants(values: Mapping[str, Real], terms: int) -> dict[str, Model]:
    """Return models of numbers."""
    return {name: Models(terms).number(value) for name, value in values.items()}
