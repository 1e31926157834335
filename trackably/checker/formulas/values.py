"""Formulas at intervals."""

from trackably.checker.arithmetic import domains
from trackably.checker.arithmetic.intervals import Real, exactly


class Intervals:
    """The arithmetic of formulas on intervals: whatever numbers these contain, the result contains the value."""

    def constant(self, value: float) -> Real:
        return exactly(value)

    def over(self, a: Real, b: Real) -> Real:
        domains.require_nonzero(b)
        return a / b

    def power(self, a: Real, exponent: float) -> Real:
        return domains.power(a, exponent)

    def function(self, name: str, a: Real) -> Real:
        return domains.function(name, a)

    def angle(self, y: Real, x: Real) -> Real:
        return domains.angle(y, x)
