"""The tests' oracle: formulas in ball arithmetic; UndefinedError where they may not be defined."""

from collections.abc import Mapping

from flint import arb

from trackably.checker.formulas import Formula, evaluate

MOST_MULTIPLIED = 64


class UndefinedError(ArithmeticError):
    """A formula may not be defined somewhere; the message says why."""


def at_balls(formula: Formula, values: Mapping[str, arb]) -> arb:
    """Enclose the formula for all `values` in the balls. UndefinedError if it may be undefined for some of them."""
    found = evaluate(formula, values, _Balls())
    if not found.is_finite():
        raise UndefinedError(DIVISION)
    return found


ANGLE = (
    "its formula takes the angle of a vector that may be zero, or may cross the direction of ±π; a vehicle has a "
    "heading only where it moves: a lower bound of its speed above zero keeps it so"
)


DIVISION = "its formula divides by something that may be zero"
_POSITIVE = {
    "log": "its formula takes the logarithm of something that may not be positive",
    "sqrt": "its formula takes the square root of something that may not be positive",
    "power": "its formula takes a fractional power of something that may not be positive",
}


def require_positive(function: str, argument: arb) -> None:
    """Raise UndefinedError if the function needs a positive argument and this one may not be positive."""
    if function in _POSITIVE and not argument > 0:
        raise UndefinedError(_POSITIVE[function])


def angle(y: arb, x: arb) -> arb:
    """Enclose atan2(y, x). UndefinedError where it may not be defined, or may jump."""
    if not (x > 0 or y > 0 or y < 0):
        raise UndefinedError(ANGLE)
    found: arb = arb.atan2(y, x)
    return found


def is_multiplied(exponent: float) -> bool:
    """Whether a power is repeated multiplication, which is defined for negative numbers too."""
    return exponent.is_integer() and abs(exponent) <= MOST_MULTIPLIED


def whole_power(x: arb, exponent: int) -> arb:
    """Enclose x^exponent tightly, by multiplication; flint's own power takes logarithms if x is a ball.

    Powers are monotone in |x|, so that the ends of the ball are enough. UndefinedError for 1/x^n where x may be zero.
    """
    if exponent < 0:
        if not (x > 0 or x < 0):
            raise UndefinedError(DIVISION)
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
        if is_multiplied(exponent):
            return whole_power(base, int(exponent))
        require_positive("power", base)
        return (base.log() * arb(exponent)).exp()

    def function(self, name: str, argument: arb) -> arb:
        require_positive(name, argument)
        found: arb = getattr(argument, name)()
        return found

    def angle(self, y: arb, x: arb) -> arb:
        return angle(y, x)
