"""Formulas in float64: intervals of real numbers, each with a bound of the error of its float64 value.

Assumed: + − · / are rounded once; functions and powers are off by 4 units in the last place at most, 8 roundings.
"""

from dataclasses import dataclass

from trackably.checker.arithmetic import domains
from trackably.checker.arithmetic.intervals import SIGN, UNIT, ZERO, Real, exactly

_UNDERFLOW = exactly(2) ** -1000
_OVERFLOW = exactly(10) ** 300


@dataclass(frozen=True)
class Rounded:
    """A real number in `exact`, and its float64 value, which differs from it by at most `error`."""

    exact: Real
    error: Real

    @property
    def computed(self) -> Real:
        """An interval that contains the float64 value and the real number."""
        return self.exact + SIGN * self.error

    def __add__(self, other: "Rounded") -> "Rounded":
        return _rounded(self.exact + other.exact, self.error + other.error, self.computed + other.computed)

    def __sub__(self, other: "Rounded") -> "Rounded":
        return _rounded(self.exact - other.exact, self.error + other.error, self.computed - other.computed)

    def __mul__(self, other: "Rounded") -> "Rounded":
        propagated = self.error * abs(other.computed) + abs(self.exact) * other.error
        return _rounded(self.exact * other.exact, propagated, self.computed * other.computed)


class RoundedFormulas:
    """Constants, quotients, powers and functions of rounded numbers; + − · are operators of `Rounded`."""

    def constant(self, value: float) -> Rounded:
        return Rounded(exactly(value), ZERO)

    def over(self, a: Rounded, b: Rounded) -> Rounded:
        domains.require_nonzero(b.computed)
        exact = a.exact / b.exact
        return _rounded(exact, (a.error + abs(exact) * b.error) / abs(b.computed), a.computed / b.computed)

    def power(self, a: Rounded, exponent: float) -> Rounded:
        slope = domains.slope_of_power(a.computed, exponent)
        exact, computed = (domains.power(x, exponent) for x in (a.exact, a.computed))
        return _rounded(exact, abs(slope) * a.error, computed, 8)

    def function(self, name: str, a: Rounded) -> Rounded:
        exact, computed = (domains.function(name, x) for x in (a.exact, a.computed))
        return _rounded(exact, abs(domains.slope_of_function(name, a.computed)) * a.error, computed, 8)

    def angle(self, y: Rounded, x: Rounded) -> Rounded:
        exact, computed = (domains.angle(*at) for at in ((y.exact, x.exact), (y.computed, x.computed)))
        return _rounded(exact, domains.change_of_angle(y.computed, x.computed, y.error, x.error), computed, 8)


def _rounded(exact: Real, propagated: Real, computed: Real, roundings: int = 1) -> Rounded:
    """Round a value whose operands have errors: add roundings of the `computed` value to the `propagated` error."""
    return Rounded(exact, rounding(propagated, computed, roundings))


def rounding(propagated: Real, computed: Real, roundings: int) -> Real:
    """Return the error of a value whose operands have errors. Raise UndefinedError where it may overflow."""
    domains.required(abs(computed).b < _OVERFLOW, "it may overflow")
    return (propagated + roundings * UNIT * abs(computed) + _UNDERFLOW).b
