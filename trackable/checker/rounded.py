"""Formulas in float64: intervals of real numbers, each with a bound of how far its float64 is away.

+ − · / are rounded once, functions and powers by 4 units in the last place, 8 roundings, at most.
"""

from dataclasses import dataclass

from trackable.checker.formulas import (
    Intervals,
    is_multiplied,
    require_nonzero,
    require_positive,
    required,
    slope_of,
    whole_power,
)
from trackable.checker.intervals import SIGN, ZERO, Real, exp, iv, log

_UNIT = iv.mpf(2) ** -53
_UNDERFLOW = iv.mpf(2) ** -1000
_OVERFLOW = iv.mpf(10) ** 300


@dataclass(frozen=True)
class Rounded:
    """A real number somewhere in `exact`, and a float64 within `error` of it."""

    exact: Real
    error: Real

    @property
    def seen(self) -> Real:
        """Holds both."""
        return self.exact + SIGN * self.error

    def __add__(self, other: "Rounded") -> "Rounded":
        return _rounded(self.exact + other.exact, self.error + other.error, self.seen + other.seen)

    def __sub__(self, other: "Rounded") -> "Rounded":
        return _rounded(self.exact - other.exact, self.error + other.error, self.seen - other.seen)

    def __mul__(self, other: "Rounded") -> "Rounded":
        moved = self.error * abs(other.seen) + abs(self.exact) * other.error
        return _rounded(self.exact * other.exact, moved, self.seen * other.seen)


class RoundedFormulas:
    """Formulas of them."""

    def constant(self, value: float) -> Rounded:
        return Rounded(iv.mpf(value), ZERO)

    def over(self, a: Rounded, b: Rounded) -> Rounded:
        require_nonzero(b.seen)
        exact = a.exact / b.exact
        return _rounded(exact, (a.error + abs(exact) * b.error) / abs(b.seen), a.seen / b.seen)

    def power(self, a: Rounded, exponent: float) -> Rounded:
        if is_multiplied(exponent):
            p = int(exponent)
            slope = p * whole_power(a.seen, p - 1) if p else ZERO
        else:
            require_positive("power", a.seen)
            slope = iv.mpf(exponent) * exp((iv.mpf(exponent) - 1) * log(a.seen))
        exact, seen = (Intervals().power(x, exponent) for x in (a.exact, a.seen))
        return _rounded(exact, abs(slope) * a.error, seen, 8)

    def function(self, name: str, a: Rounded) -> Rounded:
        exact, seen = (Intervals().function(name, x) for x in (a.exact, a.seen))
        return _rounded(exact, abs(slope_of(name, a.seen)) * a.error, seen, 8)


def _rounded(exact: Real, moved: Real, seen: Real, roundings: int = 1) -> Rounded:
    """What is `moved` by the errors of its operands, and then rounded from somewhere in `seen`."""
    required(bool(abs(seen).b < _OVERFLOW), "it may overflow")
    return Rounded(exact, iv.mpf((moved + roundings * _UNIT * abs(seen) + _UNDERFLOW).b))
