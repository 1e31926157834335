"""Closed intervals: bounds of scalar quantities."""

import math
from dataclasses import dataclass
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from typing import Literal, Self

import numpy as np

from trackably.arrays import Array

_ROUNDING = 1e-12  # of the width


def rounded(value: float, towards: Literal["up", "down"], digits: int = 3) -> str:
    """Format a number, rounded up or down where so many digits do not tell it: what is said then says no more."""
    nearest = f"{value + 0.0:.{digits}g}"  # zero has no sign for people
    if float(nearest) == value or not math.isfinite(value):
        return nearest
    context = Context(digits, ROUND_CEILING if towards == "up" else ROUND_FLOOR)
    return f"{float(context.create_decimal_from_float(value)):.{digits}g}"


def ends_shown(lower: float, upper: float) -> tuple[str, str]:
    """Format two bounds, rounded outwards, with digits that show a thousandth of their distance; with 6 at least."""
    digits = _digits(lower, upper)
    return rounded(lower, "down", digits), rounded(upper, "up", digits)


def _digits(lower: float, upper: float) -> int:
    largest, width = max(abs(lower), abs(upper)), abs(upper - lower)
    if not (0 < width < math.inf and largest < math.inf):
        return 6
    return min(max(6, math.ceil(math.log10(largest / width)) + 3), 17)


@dataclass(frozen=True)
class Interval:
    """[lower, upper] with finite lower ≤ upper. ValueError: anything else."""

    lower: float
    upper: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.lower) and math.isfinite(self.upper) and self.lower <= self.upper):
            raise ValueError(f"an interval needs finite bounds, lower ≤ upper, got [{self.lower}, {self.upper}]")

    @property
    def width(self) -> float:
        return self.upper - self.lower

    def margin(self, values: Array) -> Array:
        """Return the distance of each value to the nearer bound, negative outside."""
        return np.minimum(values - self.lower, self.upper - values)

    def strictly_contains(self, value: float) -> bool:
        """Whether a value lies strictly between the bounds."""
        return self.lower < value < self.upper

    def snapped(self, value: float) -> float:
        """Return the bound from which rounding alone tells a value; the value itself where it lies elsewhere."""
        nearer = min((self.lower, self.upper), key=lambda end: abs(value - end))
        return nearer if abs(value - nearer) <= _ROUNDING * self.width else value

    def margin_of(self, other: "Interval") -> float:
        """Return the smallest margin of the values in another interval."""
        return min(other.lower - self.lower, self.upper - other.upper)

    def contains(self, other: "Interval") -> bool:
        return self.lower <= other.lower and other.upper <= self.upper

    def __str__(self) -> str:
        return f"[{', '.join(ends_shown(self.lower, self.upper))}]"

    @property
    def exactly(self) -> str:
        """As text that tells both bounds exactly: what breaks this interval may not break a wider one."""
        ends = (f"{end:g}" if float(f"{end:g}") == end else repr(end) for end in (self.lower + 0.0, self.upper + 0.0))
        return f"[{', '.join(ends)}]"

    def shown(self, value: float) -> str:
        """Format a value beside the bounds, with the digits that tell it from a bound that it does not equal."""
        value += 0.0  # zero has no sign for people
        for digits in range(_digits(self.lower, self.upper), 17):
            text = f"{value:.{digits}g}"
            if float(text) == value or float(text) not in {self.lower, self.upper}:
                return text
        return repr(value)

    def shrunk(self, by: float) -> Self:
        return type(self)(self.lower + by, self.upper - by)
