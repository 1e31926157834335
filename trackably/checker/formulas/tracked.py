"""Formulas over a box of time: Taylor models, each with a bound of the error of its float64 value.

Assumed: + − · / are rounded once; functions and powers are off by 4 units in the last place at most, 8 roundings.
"""

from dataclasses import dataclass

from trackably.checker.arithmetic import domains
from trackably.checker.arithmetic.intervals import SIGN, ZERO, Real
from trackably.checker.arithmetic.models import Model, Models
from trackably.checker.formulas.rounded import rounding


@dataclass(frozen=True)
class Tracked:
    """Real numbers in a `model`, and their float64 values, which differ from them by at most `error`."""

    model: Model
    error: Real

    @property
    def computed(self) -> Real:
        """An interval that contains the float64 values and the real numbers."""
        return self.model.span + SIGN * self.error

    def __add__(self, other: "Tracked") -> "Tracked":
        return _rounded(self.model + other.model, self.error + other.error)

    def __sub__(self, other: "Tracked") -> "Tracked":
        return _rounded(self.model - other.model, self.error + other.error)

    def __mul__(self, other: "Tracked") -> "Tracked":
        propagated = self.error * abs(other.computed) + abs(self.model.span) * other.error
        return _rounded(self.model * other.model, propagated)


@dataclass(frozen=True)
class TrackedFormulas:
    """The arithmetic of formulas on tracked models with so many `terms`."""

    terms: int

    @property
    def _models(self) -> Models:
        return Models(self.terms)

    def constant(self, value: float) -> Tracked:
        return Tracked(self._models.constant(value), ZERO)

    def over(self, a: Tracked, b: Tracked) -> Tracked:
        domains.require_nonzero(b.computed)
        found = self._models.over(a.model, b.model)
        return _rounded(found, (a.error + abs(found.span) * b.error) / abs(b.computed))

    def power(self, a: Tracked, exponent: float) -> Tracked:
        slope = domains.slope_of_power(a.computed, exponent)
        return _rounded(self._models.power(a.model, exponent), abs(slope) * a.error, 8)

    def function(self, name: str, a: Tracked) -> Tracked:
        domains.require_positive(name, a.computed)
        slope = domains.slope_of_function(name, a.computed)
        return _rounded(self._models.function(name, a.model), abs(slope) * a.error, 8)

    def angle(self, y: Tracked, x: Tracked) -> Tracked:
        domains.side(y.computed, x.computed)
        changed = domains.change_of_angle(y.computed, x.computed, y.error, x.error)
        return _rounded(self._models.angle(y.model, x.model), changed, 8)


def _rounded(model: Model, propagated: Real, roundings: int = 1) -> Tracked:
    return Tracked(model, rounding(propagated, model.span + SIGN * propagated, roundings))
