"""Formulas in float64: intervals of real numbers, each with a bound of how far its float64 is away.

Assumed: + − · / are rounded once; functions and powers are off by 4 units in the last place at most, 8 roundings.
"""

from dataclasses import dataclass

from trackable.checker.arithmetic import domains
from trackable.checker.arithmetic.intervals import SIGN, UNIT, ZERO, Real, exactly

_UNDERFLOW = exactly(2) ** -1000
_OVERFLOW = exactly(10) ** 300


@dataclass(frozen=True)
class Rounded:
    """A real number somewhere in `exact`, and a float64 within `error` of it."""

    exact: Real
    error: Real

    @property
    def seen(self) -> Real:
        """An interval that contains both."""
        return self.exact + SIGN * self.error

    def __add__(self, other: "Rounded") -> "Rounded":
        return _rounded(self.exact + other.exact, self.error + other.error, self.seen + other.seen)

    def __sub__(self, other: "Rounded") -> "Rounded":
        return _rounded(self.exact - other.exact, self.error + other.error, self.seen - other.seen)

    def __mul__(self, other: "Rounded") -> "Rounded":
        moved = self.error * abs(other.seen) + abs(self.exact) * other.error
        return _rounded(self.exact * other.exact, moved, self.seen * other.seen)


class RoundedFormulas:
    """The arithmetic of formulas on rounded numbers."""

    def constant(self, value: float) -> Rounded:
        return Rounded(exactly(value), ZERO)

    def over(self, a: Rounded, b: Rounded) -> Rounded:
        domains.require_nonzero(b.seen)
        exact = a.exact / b.exact
        return _rounded(exact, (a.error + abs(exact) * b.error) / abs(b.seen), a.seen / b.seen)

    def power(self, a: Rounded, exponent: float) -> Rounded:
        slope = domains.slope_of_power(a.seen, exponent)
        exact, seen = (domains.power(x, exponent) for x in (a.exact, a.seen))
        return _rounded(exact, abs(slope) * a.error, seen, 8)

    def function(self, name: str, a: Rounded) -> Rounded:
        exact, seen = (domains.function(name, x) for x in (a.exact, a.seen))
        return _rounded(exact, abs(domains.slope_of_function(name, a.seen)) * a.error, seen, 8)


def _rounded(exact: Real, moved: Real, seen: Real, roundings: int = 1) -> Rounded:
    """Return a result that is `moved` by the errors of its operands and then rounded from somewhere in `seen`."""
    domains.required(bool(abs(seen).b < _OVERFLOW), "it may overflow")
    return Rounded(exact, exactly((moved + roundings * UNIT * abs(seen) + _UNDERFLOW).b))
