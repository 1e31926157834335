"""Closed intervals: bounds of scalar quantities."""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np

from trackable.arrays import Array


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

    def margin_of(self, other: "Interval") -> float:
        """Return the smallest margin of the values in another interval."""
        return min(other.lower - self.lower, self.upper - other.upper)

    def contains(self, other: "Interval") -> bool:
        return self.lower <= other.lower and other.upper <= self.upper

    def __str__(self) -> str:
        return f"[{self.lower:g}, {self.upper:g}]"

    def shrunk(self, by: float) -> Self:
        return type(self)(self.lower + by, self.upper - by)
