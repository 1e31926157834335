"""The tests' oracle: formulas in ball arithmetic; UndefinedError where they may not be defined."""

from collections.abc import Mapping

from flint import arb

from tests.formulas import evaluate
from trackably.checker.formulas import Formula

MOST_MULTIPLIED = 64


class UndefinedError(ArithmeticError):
    """A formula may not be defined somewhere."""


def at_balls(formula: Formula, values: Mapping[str, arb]) -> arb:
    """Enclose the formula for all `values` in the balls. UndefinedError if it may be undefined for some of them."""
    found = evaluate(formula, values, _Balls())
    if not found.is_finite():
        raise UndefinedError
    return found


def whole_power(x: arb, exponent: int) -> arb:
    """Enclose x^exponent tightly, by multiplication; flint's own power takes logarithms if x is a ball.

    Powers are monotone in |x|, so that the ends of the ball are enough. UndefinedError for 1/x^n where x may be zero.
    """
    if exponent < 0:
        if not (x > 0 or x < 0):
            raise UndefinedError
        return 1 / whole_power(x, -exponent)
    ends = (x.lower(), x.upper()) if exponent % 2 else (abs(x).lower().max(arb(0)), abs(x).upper())
    low, high = (_multiplied(end, exponent) for end in ends)
    return low.union(high)


def _multiplied(x: arb, exponent: int) -> arb:
    found = arb(1)
    for bit in f"{exponent:b}":
        found = found * found * x if bit == "1" else found * found
    return found


class _Balls:
    def constant(self, value: float) -> arb:
        return arb(value)

    def over(self, a: arb, b: arb) -> arb:
        return a / b

    def power(self, base: arb, exponent: float) -> arb:
        if exponent.is_integer() and abs(exponent) <= MOST_MULTIPLIED:  # defined for negative numbers too
            return whole_power(base, int(exponent))
        if not base > 0:
            raise UndefinedError
        return (base.log() * arb(exponent)).exp()

    def function(self, name: str, argument: arb) -> arb:
        if name in ("log", "sqrt") and not argument > 0:
            raise UndefinedError
        found: arb = getattr(argument, name)()
        return found

    def angle(self, y: arb, x: arb) -> arb:
        if not (x > 0 or y > 0 or y < 0):  # it may not be defined, or may jump
            raise UndefinedError
        found: arb = arb.atan2(y, x)
        return found
