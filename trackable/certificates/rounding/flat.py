"""Bound the error of evaluating flat forms in float64: over a box of time, as it depends on where signals are there.

A vehicle's heading is the angle of a difference of positions: its error is bounded where this difference is not zero,
and nothing but the box says so. So errors are bounded in each box of a proof, together with enclosures.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from flint import arb, arb_poly

from trackable.arrays import Array
from trackable.certificates.balls.arithmetic import ball_arithmetic, float_above
from trackable.certificates.balls.formulas import UndefinedError
from trackable.certificates.balls.models import Enclosure
from trackable.certificates.exact import ExactQuantity, rational
from trackable.certificates.rounding.rows import SLACK, Row, SignalErrors, absolute_weights, rows
from trackable.certificates.rounding.tracked import Tracked, TrackedModels
from trackable.gp.period import common_period
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.flat.functional import Functional
from trackable.systems.flat.trajectory import Trajectory, single_signal
from trackable.systems.formulas.evaluation import evaluate
from trackable.systems.reference import Reference

_TIMES = 101
_ENLARGED = 2
"""Errors are stated this much larger than they are found at single times: those in boxes are then no larger."""


def has_flat_form(plant: ConstrainedSystem) -> bool:
    """Whether states and inputs are formulas of a flat form."""
    return plant.flat_form is not None


@dataclass(frozen=True)
class FormulaRounding:
    """What rounds a weighted sum of formulas: the formulas with their weights, and the errors of their arguments."""

    parts: tuple[tuple[Fraction, Trajectory], ...]
    errors: Mapping[str, arb]
    roundings: int

    @classmethod
    def of(cls, row: Row, of_signals: SignalErrors) -> "FormulaRounding":
        """Return it for a bounded quantity, at the times for which the errors of signals are bounded."""
        parts = tuple((w, single_signal(p) if isinstance(p, Functional) else p) for w, p in row.used)
        functionals = {name: q for _, part in parts for name, q in part.arguments}
        errors = {
            name: of_signals.of_sum(*absolute_weights([Fraction(1)], [q])).error for name, q in functionals.items()
        }
        return cls(parts, errors, of_signals.roundings)

    def error(self, arguments: Mapping[str, Enclosure]) -> arb:
        """Bound the error where the arguments have these values. UndefinedError where there is no bound."""
        values = {name: Tracked(arguments[name], error) for name, error in self.errors.items()}
        total, size = arb(0), arb(0)
        for weight, part in self.parts:
            found = evaluate(part.formula, values, TrackedModels())
            total += rational(abs(weight)) * found.error
            size += rational(abs(weight)) * abs(found.computed)
        return SLACK * (total + self.roundings * arb(2) ** -53 * size) + arb(2) ** -300

    def error_at(self, quantity: ExactQuantity, t: arb) -> float:
        """Bound the error at a time; infinite where there is no bound."""
        with ball_arithmetic(1):
            try:
                return float_above(self.error({name: point(q.at(t)) for name, q in quantity.arguments.items()}))
            except UndefinedError:
                return math.inf


def formula_roundings(reference: Reference, until: float) -> dict[str, FormulaRounding]:
    """Return what rounds each bounded quantity that is a formula of a flat form, up to `until` [s], by name."""
    if not has_flat_form(reference.plant):
        return {}
    with ball_arithmetic(2):
        of_signals = SignalErrors.of(reference, until)
        return {row.name: FormulaRounding.of(row, of_signals) for row in rows(reference.plant) if row.formulas}


def nearby_error(reference: Reference, row: Row, of_signals: SignalErrors, times: Array | None) -> float:
    """Return what the error of a row is at most near all `times` [s], or near some, if none are given; an estimate.

    Infinite where the row is defined at none of the times.
    """
    rounding = FormulaRounding.of(row, of_signals)
    functionals = {name: q for _, part in rounding.parts for name, q in part.arguments}
    signals = [signal.summed for signal in reference.kernel_sums]
    at = _some_times(reference) if times is None else times
    values = {name: q(signals, at) for name, q in functionals.items()}
    largest = 0.0
    for i in range(len(at)):
        largest = max(largest, _error_at(rounding, {name: float(value[i]) for name, value in values.items()}))
    return _ENLARGED * largest or math.inf


def _error_at(rounding: FormulaRounding, values: Mapping[str, float]) -> float:
    with ball_arithmetic(1):
        try:
            return float_above(rounding.error({name: point(arb(value)) for name, value in values.items()}))
        except UndefinedError:
            return 0.0


def point(value: arb) -> Enclosure:
    """Return the enclosure of a constant."""
    return Enclosure(arb_poly([value]), arb(0))


def _some_times(reference: Reference) -> Array:
    period = common_period([signal.kernel for signal in reference.kernel_sums])
    if period is not None:
        return np.linspace(0.0, period, _TIMES)
    centres = np.concatenate([signal.centres for signal in reference.kernel_sums])
    return np.linspace(float(np.min(centres)), float(np.max(centres)), _TIMES)
