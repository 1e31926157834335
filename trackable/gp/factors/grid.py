"""Regularly spaced times, as far as rounding lets them be."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from trackable.arrays import Array

_REGULAR = 1e-6


@dataclass(frozen=True)
class Grid:
    """The times start + i step for i = 0 … count − 1 [s]; those it stands for lie within `deviation` [s] of them."""

    start: float
    step: float
    count: int
    deviation: float

    @classmethod
    def of(cls, times: Array) -> Self | None:
        """The grid from the first of some times (n,) to the last; None where they do not lie on it, or are too few."""
        if times.ndim != 1 or len(times) < 3 or not times[-1] > times[0]:
            return None
        start, count = float(times[0]), len(times)
        step = (float(times[-1]) - start) / (count - 1)
        deviation = float(np.max(np.abs(times - (start + step * np.arange(count)))))
        return cls(start, step, count, deviation) if deviation <= _REGULAR * step else None

    @property
    def lags(self) -> Array:
        """i step [s], shape (count,)."""
        return self.step * np.arange(self.count, dtype=float)

    @property
    def span(self) -> float:
        """From the first to the last [s]."""
        return self.step * (self.count - 1)

    @property
    def rounding(self) -> float:
        """How far rounding alone can move a time, and that of its place on the grid [s]."""
        return 2 * float(np.spacing(max(abs(self.start), abs(self.start + self.span))))

    @property
    def is_exact(self) -> bool:
        """Whether nothing but rounding keeps the times from lying on it."""
        return self.deviation <= self.rounding
