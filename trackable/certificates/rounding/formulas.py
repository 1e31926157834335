"""Bounds of the error of evaluating a formula in float64: intervals with errors, carried from node to node.

Assumed, as everywhere: + − · / and NumPy's functions as `rounding.references` says. Bounds over-estimate.
"""

from dataclasses import dataclass
from typing import Self

from flint import arb

from trackable.certificates.balls.formulas import DIVISION, UndefinedError, is_multiplied, require_positive, whole_power

_UNIT = arb(2) ** -53 * arb(1.02)
_FUNCTION = 10
"""Roundings of a function: 4 units in the last place are 8 of these at most."""

_TINY = arb(2) ** -999
_LARGEST = arb(10) ** 300


@dataclass(frozen=True)
class Rounded:
    """A real number somewhere in the ball `exact`, and a float64 within `error` of it."""

    exact: arb
    error: arb

    @property
    def seen(self) -> arb:
        """A ball that holds the float64, and the real number too."""
        return self.exact + arb(0, 1) * self.error

    def __add__(self, other: Self) -> "Rounded":
        return _rounded(self.exact + other.exact, self.error + other.error, self.seen + other.seen)

    def __sub__(self, other: Self) -> "Rounded":
        return _rounded(self.exact - other.exact, self.error + other.error, self.seen - other.seen)

    def __mul__(self, other: Self) -> "Rounded":
        moved = self.error * abs(other.seen) + abs(self.exact) * other.error
        return _rounded(self.exact * other.exact, moved, self.seen * other.seen)

    def __truediv__(self, other: Self) -> "Rounded":
        if not (other.seen > 0 or other.seen < 0):
            raise UndefinedError(DIVISION)
        exact = self.exact / other.exact
        moved = (self.error + abs(exact) * other.error) / abs(other.seen)
        return _rounded(exact, moved, self.seen / other.seen)


class RoundedArithmetic:
    """The arithmetic of formulas on rounded numbers."""

    def constant(self, value: float) -> Rounded:
        return Rounded(arb(value), arb(0))

    def power(self, base: Rounded, exponent: float) -> Rounded:
        if not is_multiplied(exponent):
            require_positive("power", base.seen)
            slope = (base.seen.log() * (arb(exponent) - 1)).exp() * arb(exponent)
            ends = [(x.log() * arb(exponent)).exp() for x in (base.exact, base.seen)]
        else:
            whole = int(exponent)
            slope = whole * whole_power(base.seen, whole - 1) if whole else arb(0)
            ends = [whole_power(x, whole) for x in (base.exact, base.seen)]
        return _rounded(ends[0], abs(slope) * base.error, ends[1], _FUNCTION)

    def function(self, name: str, argument: Rounded) -> Rounded:
        require_positive(name, argument.seen)
        slopes = {
            "exp": lambda x: x.exp(),
            "log": lambda x: 1 / x,
            "sqrt": lambda x: 1 / (2 * x.sqrt()),
            "sin": lambda x: x.cos(),
            "cos": lambda x: x.sin(),
        }
        exact, seen = (getattr(x, name)() for x in (argument.exact, argument.seen))
        return _rounded(exact, abs(slopes[name](argument.seen)) * argument.error, seen, _FUNCTION)


def _rounded(exact: arb, moved: arb, seen: arb, roundings: int = 1) -> Rounded:
    """Return a result that is `moved` by the errors of its operands and then rounded from somewhere in `seen`."""
    if not abs(seen) < _LARGEST:
        raise UndefinedError("its float64 evaluation may overflow")
    return Rounded(exact, (moved + roundings * _UNIT * abs(seen) + _TINY).upper())
