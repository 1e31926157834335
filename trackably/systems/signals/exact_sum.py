"""Sums of a few float64 without any rounding, elementwise in arrays: times are compared and subtracted by them."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Self

import numpy as np
import numpy.typing as npt

from trackably.arrays import Array
from trackably.systems.signals.double_double import DoubleDouble, two_product, two_sum


@dataclass(frozen=True, eq=False)
class ExactSum:
    """The exact sum of `parts`, ordered by size: an expansion, as Shewchuk (1997) calls it.

    Between the binary digits of two parts there is an empty place at least, as long as each term is added to a sum that
    began with one float64. So all smaller parts together are less than half of the largest one.
    """

    parts: tuple[Array, ...]

    @classmethod
    def of(cls, terms: Iterable[Array]) -> Self:
        """Return the sum of float64 numbers."""
        first, *others = terms
        found = cls((first,))
        for term in others:
            found = found + term
        return found

    def __add__(self, term: Array) -> Self:
        found, total = [], term
        for part in self.parts:
            total, error = two_sum(total, part)
            found.append(error)
        return type(self)((*found, total))

    @property
    def rounded(self) -> Array:
        """The sum in float64, within 8 u of its size as long as there are eight parts at most: its sign is right."""
        total = self.parts[0]
        for part in self.parts[1:]:
            total = total + part
        return total

    @property
    def double_double(self) -> DoubleDouble:
        """The sum, within 80 u² of its size as long as there are seven parts at most."""
        near = self.rounded
        return DoubleDouble(*two_sum(near, (self + -near).rounded))

    def turned_back(self, count: Array, period: Array) -> Self:
        """Return the sum minus `count` times a period."""
        whole, rest = two_product(count, period)
        return self + -whole + -rest

    def replaced(self, where: npt.NDArray[np.bool_], value: float) -> Self:
        """Return a number in place of the sum at some places."""
        *others, last = (np.where(where, 0.0, part) for part in self.parts)
        return type(self)((*others, np.where(where, value, last)))
