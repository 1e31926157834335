"""Regularly spaced times, up to rounding."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from trackably.arrays import Array

_REGULAR = 1e-6  # of a step: a larger deviation is not regular


@dataclass(frozen=True)
class Grid:
    """The times start + i step [s] for i = 0 … count − 1, which approximate given times up to `deviation` [s]."""

    start: float
    step: float
    count: int
    deviation: float

    @classmethod
    def of(cls, times: Array) -> Self | None:
        """Return the grid from the first of `times` (n,) to the last; None if they do not lie on it or n < 3."""
        if times.ndim != 1 or len(times) < 3 or not times[-1] > times[0]:
            return None
        start, count = float(times[0]), len(times)
        step = (float(times[-1]) - start) / (count - 1)
        deviation = float(np.max(np.abs(times - (start + step * np.arange(count)))))
        return cls(start, step, count, deviation) if deviation <= _REGULAR * step else None

    @property
    def lags(self) -> Array:
        """The lags i step [s], shape (count,)."""
        return self.step * np.arange(self.count, dtype=float)

    @property
    def span(self) -> float:
        """The duration from the first time to the last [s]."""
        return self.step * (self.count - 1)

    @property
    def rounding(self) -> float:
        """The largest deviation [s] that rounding alone can cause, of a time and of its grid point together."""
        return 2 * float(np.spacing(max(abs(self.start), abs(self.start + self.span))))

    @property
    def is_exact(self) -> bool:
        """Whether the times deviate from the grid by rounding only."""
        return self.deviation <= self.rounding
