"""Formulas over a box of time, each part with its Taylor model and a bound of the error of its float64 value.

The assumptions about + − · / and NumPy's functions are those of `rounding.references`. Bounds over-estimate.
"""

from dataclasses import dataclass

from flint import arb

from trackable.certificates.balls.formulas import (
    ANGLE,
    DIVISION,
    UndefinedError,
    is_multiplied,
    require_positive,
    whole_power,
)
from trackable.certificates.balls.models import Enclosure, Models
from trackable.certificates.rounding.formulas import FUNCTION, SLOPES, rounding_error

_MODELS = Models()


@dataclass(frozen=True)
class Tracked:
    """Real numbers in the `model`, and their float64 values, which differ from them by at most `error`."""

    model: Enclosure
    error: arb

    @property
    def computed(self) -> arb:
        """A ball that contains all float64 values and real numbers."""
        return self.model.span + arb(0, 1) * self.error

    def __add__(self, other: "Tracked") -> "Tracked":
        return _rounded(self.model + other.model, self.error + other.error)

    def __sub__(self, other: "Tracked") -> "Tracked":
        return _rounded(self.model - other.model, self.error + other.error)

    def __mul__(self, other: "Tracked") -> "Tracked":
        propagated = self.error * abs(other.computed) + abs(self.model.span) * other.error
        return _rounded(self.model * other.model, propagated)

    def __truediv__(self, other: "Tracked") -> "Tracked":
        divisor = other.computed
        if not (divisor > 0 or divisor < 0):
            raise UndefinedError(DIVISION)
        found = self.model / other.model
        return _rounded(found, (self.error + abs(found.span) * other.error) / abs(divisor))


class TrackedModels:
    """Constants, powers and functions of tracked numbers; + − · / are operators of `Tracked`."""

    def constant(self, value: float) -> Tracked:
        return Tracked(_MODELS.constant(value), arb(0))

    def power(self, base: Tracked, exponent: float) -> Tracked:
        if is_multiplied(exponent):
            whole = int(exponent)
            slope = whole * whole_power(base.computed, whole - 1) if whole else arb(0)
        else:
            require_positive("power", base.computed)
            slope = (base.computed.log() * (arb(exponent) - 1)).exp() * arb(exponent)
        return _rounded(_MODELS.power(base.model, exponent), abs(slope) * base.error, FUNCTION)

    def function(self, name: str, argument: Tracked) -> Tracked:
        require_positive(name, argument.computed)
        slope = SLOPES[name](argument.computed)
        return _rounded(_MODELS.function(name, argument.model), abs(slope) * argument.error, FUNCTION)

    def angle(self, y: Tracked, x: Tracked) -> Tracked:
        a, b = x.computed, y.computed
        if not (a > 0 or b > 0 or b < 0):
            raise UndefinedError(ANGLE)
        propagated = (abs(a) * y.error + abs(b) * x.error) / (whole_power(a, 2) + whole_power(b, 2))
        return _rounded(_MODELS.angle(y.model, x.model), propagated, FUNCTION)


def _rounded(model: Enclosure, propagated: arb, roundings: int = 1) -> Tracked:
    computed = model.span + arb(0, 1) * propagated
    return Tracked(model, rounding_error(propagated, computed, roundings))
