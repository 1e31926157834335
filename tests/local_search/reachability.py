"""Exact reachability of x⁺ = x + α sin 4x + b u with u and x in intervals: whether any plan leads to a point.

The image of an interval under a continuous function is an interval, from its least to its largest value; adding the
interval of b u and intersecting with X gives an interval again. So the states that are reached in i steps are one
interval, exactly, up to the rounding of its ends.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Sine:
    """x⁺ = x + `alpha` sin 4x + `gain` u with |u| ≤ `most` and |x| ≤ `reach`."""

    alpha: float
    gain: float = 0.2
    most: float = 5.0
    reach: float = 2.0

    def drift(self, x):
        return x + self.alpha * np.sin(4 * x)

    def image(self, low: float, high: float) -> tuple[float, float]:
        """Return the least and the largest x + α sin 4x on [low, high]: at an end, or where 1 + 4 α cos 4x = 0."""
        points = [low, high]
        if 4 * self.alpha >= 1:
            for turn in range(-3, 4):
                for side in (-1, 1):
                    x = (2 * np.pi * turn + side * np.arccos(-1 / (4 * self.alpha))) / 4
                    points += [x] if low < x < high else []
        values = self.drift(np.array(points))
        return float(values.min()), float(values.max())

    def slack(self, state: float, end: float, horizon: int) -> float:
        """Return how far inside the set reached in `horizon` steps the point `end` lies; negative where outside, and
        −∞ where no plan keeps the state in its interval.

        The current state need not be in it, those after it must.
        """
        low = high = state
        for _ in range(horizon):
            low, high = self.image(low, high)
            low, high = low - self.gain * self.most, high + self.gain * self.most
            if max(low, -self.reach) > min(high, self.reach):
                return -np.inf
            inside = min(end - low, high - end)
            low, high = max(low, -self.reach), min(high, self.reach)
        return inside
