"""Formulas with their slopes (forward differentiation)."""

from dataclasses import dataclass

from trackably.checker.arithmetic import domains
from trackably.checker.arithmetic.intervals import ZERO, Real, exactly


@dataclass(frozen=True)
class Sloped:
    """An interval of values, and intervals of their slopes in some directions."""

    value: Real
    slopes: list[Real]

    def __add__(self, other: "Sloped") -> "Sloped":
        return Sloped(self.value + other.value, [a + b for a, b in zip(self.slopes, other.slopes, strict=True)])

    def __sub__(self, other: "Sloped") -> "Sloped":
        return Sloped(self.value - other.value, [a - b for a, b in zip(self.slopes, other.slopes, strict=True)])

    def __mul__(self, other: "Sloped") -> "Sloped":
        slopes = zip(self.slopes, other.slopes, strict=True)
        return Sloped(self.value * other.value, [a * other.value + self.value * b for a, b in slopes])


@dataclass(frozen=True)
class SlopedFormulas:
    """The arithmetic of formulas on values with slopes in so many `directions`."""

    directions: int

    def constant(self, value: float) -> Sloped:
        return Sloped(exactly(value), [ZERO] * self.directions)

    def over(self, a: Sloped, b: Sloped) -> Sloped:
        domains.require_nonzero(b.value)
        value = a.value / b.value
        return Sloped(value, [(x - value * y) / b.value for x, y in zip(a.slopes, b.slopes, strict=True)])

    def power(self, a: Sloped, exponent: float) -> Sloped:
        return _chained(domains.power(a.value, exponent), domains.slope_of_power(a.value, exponent), a)

    def function(self, name: str, a: Sloped) -> Sloped:
        return _chained(domains.function(name, a.value), domains.slope_of_function(name, a.value), a)

    def angle(self, y: Sloped, x: Sloped) -> Sloped:
        value, length = (
            domains.angle(y.value, x.value),
            domains.whole_power(x.value, 2) + domains.whole_power(y.value, 2),
        )
        domains.require_nonzero(length)
        slopes = zip(y.slopes, x.slopes, strict=True)
        return Sloped(value, [(x.value * a - y.value * b) / length for a, b in slopes])


def _chained(value: Real, slope: Real, a: Sloped) -> Sloped:
    return Sloped(value, [slope * x for x in a.slopes])
