"""Where functions are defined: what is not certainly defined raises UndefinedError."""

from typing import Any

from trackably.checker.arithmetic.intervals import (
    INFINITE,
    ONE,
    SIGN,
    Many,
    Real,
    atan,
    cos,
    either,
    exactly,
    exp,
    log,
    pi,
    sin,
    sqrt,
)

MOST_MULTIPLIED = 64
"""Whole exponents up to this size are repeated multiplication; x^p is exp(p log x) for others, defined for x > 0."""


class UndefinedError(ArithmeticError):
    """A value that may not be defined; the message says why. Of many values, `where` says which of them are."""

    def __init__(self, why: str, where: Any = False) -> None:
        super().__init__(why)
        self.where = where


def required(condition: Any, what: str) -> None:
    """Raise UndefinedError unless the condition is certain, for each of many values."""
    is_many = hasattr(condition, "all")
    if not (condition.all() if is_many else condition):
        raise UndefinedError(what, is_many and condition)


def require_nonzero(x: Real) -> None:
    """Raise UndefinedError where an interval contains zero."""
    required(either(x.a > 0, x.b < 0), "what it divides by may be zero")


def require_positive(function: str, x: Real) -> None:
    """Raise UndefinedError where a logarithm, square root or fractional power may get a number that is not positive."""
    if function in ("log", "sqrt", "power"):
        what = {"log": "logarithm", "sqrt": "square root", "power": "fractional power"}[function]
        required(x.a > 0, f"the argument of a {what} may not be positive")


def bounded(x: Real) -> Real:
    """Return the interval itself. Raise UndefinedError where it has no bounds."""
    required(abs(x).b < INFINITE.b, "nothing bounds it")
    return x


def around(middle: Real, reach: Real) -> Real:
    """Return all numbers within `reach` of `middle`."""
    return middle + SIGN * reach


def is_multiplied(exponent: float) -> bool:
    """Return whether a power is repeated multiplication."""
    return exponent.is_integer() and abs(exponent) <= MOST_MULTIPLIED


def whole_power(a: Real, exponent: int) -> Real:
    """Return a^exponent, also of an interval that contains zero."""
    if exponent < 0:
        require_nonzero(a)
        return ONE / whole_power(a, -exponent)
    return (a if exponent % 2 else abs(a)) ** exponent if exponent else ONE


def power(a: Real, exponent: float) -> Real:
    """Return a^exponent. Raise UndefinedError where it may not be defined."""
    if is_multiplied(exponent):
        return whole_power(a, int(exponent))
    require_positive("power", a)
    return bounded(exp(exactly(exponent) * log(a)))


def function(name: str, a: Real) -> Real:
    """Return exp, log, sqrt, sin, cos or atan of an interval. Raise UndefinedError where it may not be defined."""
    require_positive(name, a)
    required(abs(a).b < 1e100, "an argument of a function has no bound")
    return bounded({"exp": exp, "log": log, "sqrt": sqrt, "sin": sin, "cos": cos, "atan": atan}[name](a))


def side(y: Real, x: Real) -> int:
    """Return 0 where x > 0, 1 where y > 0 and −1 where y < 0: a half-plane in which the angle of (x, y) is continuous.

    0 for many vectors: it is not the same for all. Raise UndefinedError where none is certain.
    """
    certain = [x.a > 0, y.a > 0, y.b < 0]
    required(either(*certain), "it takes the angle of a vector that may be zero, or may cross the direction of ±π")
    if isinstance(x, Many) or isinstance(y, Many):
        return 0
    steep = abs(y).mid > abs(x).mid or not certain[0]
    return (1 if certain[1] else -1) if steep and (certain[1] or certain[2]) else 0


def angle(y: Real, x: Real) -> Real:
    """Return atan2(y, x). Raise UndefinedError where it may not be defined, or may jump."""
    s = side(y, x)
    return atan(y / x) if not s else s * pi() / 2 - atan(x / y)


def slope_of_power(a: Real, exponent: float) -> Real:
    """Return an interval that contains the derivative of x^exponent at each x of an interval."""
    if is_multiplied(exponent):
        p = int(exponent)
        return p * whole_power(a, p - 1) if p else exactly(0)
    require_positive("power", a)
    return exactly(exponent) * exp((exactly(exponent) - 1) * log(a))


def slope_of_function(name: str, a: Real) -> Real:
    """Return an interval that contains φ′(x) at each x of an interval on which φ is defined."""
    if name in ("sin", "cos"):
        return cos(a) if name == "sin" else -sin(a)
    if name == "atan":
        return ONE / (1 + whole_power(a, 2))
    return exp(a) if name == "exp" else ONE / (a if name == "log" else 2 * sqrt(a))


def change_of_angle(y: Real, x: Real, by_y: Real, by_x: Real) -> Real:
    """Over-estimate how much atan2(y, x) changes if y and x change by so much, all the way within these intervals."""
    length = whole_power(x, 2) + whole_power(y, 2)
    require_nonzero(length)
    return (abs(x) * by_y + abs(y) * by_x) / length
