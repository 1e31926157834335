"""Margins as float64 sees them: they choose the boxes of a proof and the times to look at, they prove nothing."""

from dataclasses import dataclass

import numpy as np

from pipeline.arrays import Array
from pipeline.learning.index_set import Window
from pipeline.systems.quantity import Quantity
from pipeline.systems.reference import Reference

_LOOKS = 1025


@dataclass(frozen=True)
class Sketch:
    """Margins of a quantity at increasing times [s], shape (n,) both."""

    times: Array
    margins: Array

    def smallest(self, start: float, end: float) -> float:
        """The smallest margin seen in [start, end] or right beside it."""
        first, last = np.searchsorted(self.times, [start, end])
        return float(np.min(self.margins[max(first - 1, 0) : last + 1]))

    @property
    def worst_time(self) -> float:
        return float(self.times[np.argmin(self.margins)])


def sketch(reference: Reference, quantity: Quantity, start: float, end: float) -> Sketch:
    """Margins on a regular grid, at their local minima, and at each centre: a short length scale shows nowhere else."""
    signals, functional = reference.signals, quantity.functional

    def margin(t: Array) -> Array:
        return quantity.margin(signals, t)

    looks = [
        (signals[c].centres[:, None] - functional.sampling_time * np.arange(len(weights))).ravel()
        for c, weights in functional.rounded
    ]
    lowest = Window(start, end).local_minima(margin, [signal.kernel for signal in signals])
    times = np.unique(np.concatenate([np.linspace(start, end, _LOOKS), *looks, lowest]))
    times = times[(times >= start) & (times <= end)]
    return Sketch(times, margin(times))
