"""Numbers of twice the precision: unevaluated sums of two float64, elementwise in arrays.

Sums and products are those of Dekker, "A floating-point technique for extending the available precision" (1971). Their
errors are bounded by Joldes, Muller and Popescu, "Tight and rigorous error bounds for basic building blocks of
double-word arithmetic" (2017): with u = 2⁻⁵³, they are less than 8 u² of |x y| in a product, and of |x| + |y| in a sum.
Numbers must neither overflow nor underflow. NumPy rounds each operation by itself, without fused multiplications.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Self

import numpy as np

from trackably.arrays import Array

_SPLITTER = 2.0**27 + 1


@dataclass(frozen=True, eq=False)
class DoubleDouble:
    """`high` + `low`, where `high` is the float64 that is nearest to the sum."""

    high: Array
    low: Array

    @classmethod
    def of(cls, numbers: Sequence[Fraction]) -> Self:
        """Return rational numbers, each within u² of its size."""
        high = [float(number) for number in numbers]
        low = [float(number - Fraction(near)) for number, near in zip(numbers, high, strict=True)]
        return cls(np.array(high), np.array(low))

    def at(self, index: Any) -> "DoubleDouble":
        """Return the numbers at an index of the arrays."""
        return DoubleDouble(self.high[index], self.low[index])

    def __add__(self, other: "DoubleDouble") -> "DoubleDouble":
        high, error = two_sum(self.high, other.high)
        low, smaller = two_sum(self.low, other.low)
        high, error = _two_sum_ordered(high, error + low)
        return DoubleDouble(*_two_sum_ordered(high, error + smaller))

    def __mul__(self, other: "DoubleDouble") -> "DoubleDouble":
        product, error = two_product(self.high, other.high)
        return DoubleDouble(*_two_sum_ordered(product, error + (self.high * other.low + self.low * other.high)))


def two_sum(a: Array, b: Array) -> tuple[Array, Array]:
    """Return s = fl(a + b) and a + b − s, which is a float64."""
    total = a + b
    of_b = total - a
    return total, (a - (total - of_b)) + (b - of_b)


def _two_sum_ordered(a: Array, b: Array) -> tuple[Array, Array]:
    """Return the same where |a| ≥ |b|, or a = 0."""
    total = a + b
    return total, b - (total - a)


def two_product(a: Array, b: Array) -> tuple[Array, Array]:
    """Return p = fl(a b) and a b − p, which is a float64."""
    product = a * b
    (a_high, a_low), (b_high, b_low) = _halves(a), _halves(b)
    return product, ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low


def moved_back(time: Sequence[Array], period: float) -> Array:
    """Return times [s], each the sum of one float64 or of two as `two_product` gives them, moved by whole periods.

    With u = 2⁻⁵³ and p = fl(n `period`), where n is the nearest whole number of periods: `high` − p is exact by
    Sterbenz's lemma, as p is at least half of `high` and at most twice, or 0. What remains of both is less than u of
    their size. So up to 2⁴⁰ periods the result is at most 0.501 periods from 0, and within 0.502 u periods of exact.
    Times within half a period stay as they are, rounded.
    """
    high, *low = time
    whole, rest = two_product(np.rint(high / period), np.asarray(period))
    return np.asarray((high - whole) + (sum(low) - rest))


def _halves(a: Array) -> tuple[Array, Array]:
    """Return two numbers of 26 bits at most, the sum of which is a."""
    scaled = _SPLITTER * a
    high = scaled - (scaled - a)
    return high, a - high
