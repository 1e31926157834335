"""Bound the error of evaluating a formula in float64: each node of the formula gets an interval and an error.

The assumptions about + − · / and NumPy's functions are those of `rounding.references`. Bounds over-estimate.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Self

from flint import arb

from trackable.certificates.balls.formulas import (
    DIVISION,
    UndefinedError,
    angle,
    is_multiplied,
    require_positive,
    whole_power,
)

_UNIT = arb(2) ** -53 * arb(1.02)
FUNCTION = 10
"""Roundings of a function: 4 units in the last place are at most 8 roundings of size u."""

_TINY = arb(2) ** -999
_LARGEST = arb(10) ** 300


@dataclass(frozen=True)
class Rounded:
    """A real number in the ball `exact`, and its float64 value, which differs from it by at most `error`."""

    exact: arb
    error: arb

    @property
    def computed(self) -> arb:
        """A ball that contains the float64 value and the real number."""
        return self.exact + arb(0, 1) * self.error

    def __add__(self, other: Self) -> "Rounded":
        return _rounded(self.exact + other.exact, self.error + other.error, self.computed + other.computed)

    def __sub__(self, other: Self) -> "Rounded":
        return _rounded(self.exact - other.exact, self.error + other.error, self.computed - other.computed)

    def __mul__(self, other: Self) -> "Rounded":
        propagated = self.error * abs(other.computed) + abs(self.exact) * other.error
        return _rounded(self.exact * other.exact, propagated, self.computed * other.computed)

    def __truediv__(self, other: Self) -> "Rounded":
        if not (other.computed > 0 or other.computed < 0):
            raise UndefinedError(DIVISION)
        exact = self.exact / other.exact
        propagated = (self.error + abs(exact) * other.error) / abs(other.computed)
        return _rounded(exact, propagated, self.computed / other.computed)


class RoundedArithmetic:
    """Constants, powers and functions of rounded numbers; + − · / are operators of `Rounded`."""

    def constant(self, value: float) -> Rounded:
        return Rounded(arb(value), arb(0))

    def power(self, base: Rounded, exponent: float) -> Rounded:
        if not is_multiplied(exponent):
            require_positive("power", base.computed)
            slope = (base.computed.log() * (arb(exponent) - 1)).exp() * arb(exponent)
            ends = [(x.log() * arb(exponent)).exp() for x in (base.exact, base.computed)]
        else:
            whole = int(exponent)
            slope = whole * whole_power(base.computed, whole - 1) if whole else arb(0)
            ends = [whole_power(x, whole) for x in (base.exact, base.computed)]
        return _rounded(ends[0], abs(slope) * base.error, ends[1], FUNCTION)

    def function(self, name: str, argument: Rounded) -> Rounded:
        require_positive(name, argument.computed)
        exact, computed = (getattr(x, name)() for x in (argument.exact, argument.computed))
        return _rounded(exact, abs(SLOPES[name](argument.computed)) * argument.error, computed, FUNCTION)

    def angle(self, y: Rounded, x: Rounded) -> Rounded:
        exact, computed = angle(y.exact, x.exact), angle(y.computed, x.computed)
        a, b = x.computed, y.computed
        propagated = (abs(a) * y.error + abs(b) * x.error) / (whole_power(a, 2) + whole_power(b, 2))
        return _rounded(exact, propagated, computed, FUNCTION)


SLOPES: dict[str, Callable[[arb], arb]] = {
    "exp": lambda x: x.exp(),
    "log": lambda x: 1 / x,
    "sqrt": lambda x: 1 / (2 * x.sqrt()),
    "sin": lambda x: x.cos(),
    "cos": lambda x: x.sin(),
    "atan": lambda x: 1 / (1 + whole_power(x, 2)),
}
"""Derivatives of functions, up to their signs."""


def _rounded(exact: arb, propagated: arb, computed: arb, roundings: int = 1) -> Rounded:
    """Round a value whose operands have errors: add roundings of the `computed` value to the `propagated` error."""
    return Rounded(exact, rounding_error(propagated, computed, roundings))


def rounding_error(propagated: arb, computed: arb, roundings: int) -> arb:
    """Return the error of a value whose operands have errors. UndefinedError: it may overflow."""
    if not abs(computed) < _LARGEST:
        raise UndefinedError("its float64 evaluation may overflow")
    total: arb = propagated + roundings * _UNIT * abs(computed) + _TINY
    return total.upper()
