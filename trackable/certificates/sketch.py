"""Approximate margins in float64: they guide the choice of boxes and of candidate times, and prove nothing."""

from dataclasses import dataclass

import numpy as np

from trackable.arrays import Array
from trackable.learning.index_set import Window
from trackable.systems.quantity import Quantity
from trackable.systems.reference import Reference

_GRID_POINTS = 1025


@dataclass(frozen=True)
class Sketch:
    """Margins of a quantity at increasing times [s], and |∂q/∂q_i| for each of its functionals; all of shape (n,)."""

    times: Array
    margins: Array
    slopes: dict[str, Array]

    def smallest(self, start: float, end: float) -> float:
        """Return the smallest margin at grid times in [start, end], and at the next one on either side."""
        return float(np.min(self.margins[self._within(start, end)]))

    def steepest(self, start: float, end: float) -> dict[str, float]:
        """Return the largest |∂q/∂q_i| at these times."""
        within = self._within(start, end)
        return {name: float(np.max(slopes[within])) for name, slopes in self.slopes.items()}

    def _within(self, start: float, end: float) -> slice:
        first, last = np.searchsorted(self.times, [start, end])
        return slice(max(int(first) - 1, 0), int(last) + 1)

    @property
    def worst_time(self) -> float:
        return float(self.times[np.argmin(self.margins)])


def sketch(reference: Reference, quantity: Quantity, start: float, end: float) -> Sketch:
    """Return margins on a regular grid, at their local minima, and near each centre (for short length scales)."""
    signals, trajectory = reference.signals, quantity.trajectory

    def margin(t: Array) -> Array:
        return quantity.margin(signals, t)

    near_centres = [
        (signals[c].centres[:, None] - trajectory.sampling_time * np.arange(len(weights))).ravel()
        for _, functional in trajectory.arguments
        for c, weights in functional.rounded
    ]
    lowest = Window(start, end).local_minima(margin, [signal.kernel for signal in signals])
    times = np.unique(np.concatenate([np.linspace(start, end, _GRID_POINTS), *near_centres, lowest]))
    times = times[(times >= start) & (times <= end)]
    slopes = trajectory.slopes({name: functional(signals, times) for name, functional in trajectory.arguments})
    sizes = {name: np.broadcast_to(np.abs(slope), times.shape) for name, slope in slopes.items()}
    return Sketch(times, margin(times), sizes)
