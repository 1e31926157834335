"""Approximate margins in float64: they guide the choice of boxes and of candidate times, and prove nothing."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from trackable.arrays import Array
from trackable.gp.remembered import Remembered
from trackable.learning.index_set import Window
from trackable.systems.flat.functional import Signals
from trackable.systems.quantities import Quantities
from trackable.systems.quantity import Quantity
from trackable.systems.reference import Reference

_GRID_POINTS, _MOST_POINTS = 1025, 50_000
_POINTS_PER_CORRELATION_TIME, _FEW_CENTRES = 4, 100
_ENOUGH = 32  # in each correlation time: more show nothing of linear combinations of signals, unlike of formulas


@dataclass(frozen=True)
class Sketch:
    """Margins of a quantity at increasing times [s], and |∂q/∂q_i| for each of its functionals; all of shape (n,)."""

    times: Array
    margins: Array
    slopes: dict[str, Array]

    def within(self, starts: Array, ends: Array) -> "Extremes":
        """Return the extremes at grid times in each [start, end], and at the next one on either side."""
        first, last = np.searchsorted(self.times, starts) - 1, np.searchsorted(self.times, ends) + 1
        within = np.stack([np.maximum(first, 0), np.minimum(last, len(self.times))], axis=1).ravel()
        steepest = {name: _over(np.maximum, slopes, within) for name, slopes in self.slopes.items()}
        return Extremes(_over(np.minimum, self.margins, within), steepest)

    @property
    def worst_time(self) -> float:
        return float(self.times[np.argmin(self.margins)])

    @property
    def least(self) -> float:
        """The smallest margin."""
        return float(np.min(self.margins))


class Extremes(NamedTuple):
    """The smallest margin in each box, and the largest |∂q/∂q_i|: shape (B,)."""

    smallest: Array
    steepest: dict[str, Array]


def sketches(reference: Reference, start: float, end: float) -> list[Sketch]:
    """Return margins on a regular grid, at their local minima, and near centres where they may change in between.

    The times are the same for all quantities.
    """
    signals = Remembered.of(reference.kernel_sums).signals
    kernels, several = [signal.kernel for signal in signals], Quantities(reference.quantities, signals)
    lowest = Window(start, end).minima_of_each(several, kernels)
    grid = np.linspace(start, end, _points((end - start) / min(k.correlation_time for k in kernels), several.is_linear))
    centres = (at for quantity in reference.quantities for at in _near_centres(reference, quantity))
    times = np.unique(np.concatenate([grid, *(at for at, _ in lowest), *centres]))
    times = times[(times >= start) & (times <= end)]
    pairs = zip(reference.quantities, several.margins(times), strict=True)
    return [Sketch(times, margins, _sizes(quantity, signals, times)) for quantity, margins in pairs]


def _points(correlation_times: float, is_linear: bool) -> int:
    """Return the number of points in a window as long as so many correlation times."""
    fewest = min(_ENOUGH * correlation_times + 2, _GRID_POINTS) if is_linear else _GRID_POINTS
    return int(np.clip(_POINTS_PER_CORRELATION_TIME * correlation_times, fewest, _MOST_POINTS))


def _sizes(quantity: Quantity, signals: Signals, times: Array) -> dict[str, Array]:
    """Return |∂q/∂q_i| for each functional."""
    trajectory = quantity.trajectory
    if trajectory.functional:
        return {name: np.ones_like(times) for name, _ in trajectory.arguments}
    slopes = trajectory.slopes({name: functional(signals, times) for name, functional in trajectory.arguments})
    return {name: np.broadcast_to(np.abs(slope), times.shape) for name, slope in slopes.items()}


def _near_centres(reference: Reference, quantity: Quantity) -> Iterator[Array]:
    """Yield the times at which the quantity looks at a centre: for short length scales, and for kernels with kinks.

    Between many centres of a smooth kernel nothing happens that the grid does not show.
    """
    for _, functional in quantity.trajectory.arguments:
        for c, weights in functional.rounded:
            signal = reference.kernel_sums[c]
            if len(signal.centres) <= _FEW_CENTRES or not signal.kernel.is_analytic:
                yield (signal.centres[:, None] - functional.sampling_time * np.arange(len(weights))).ravel()


def _over(extreme: np.ufunc, values: Array, within: npt.NDArray[np.intp]) -> Array:
    """Return the extremes of `values` within intervals, which may overlap; the second ends do not count."""
    return np.asarray(extreme.reduceat(np.append(values, values[-1:]), within)[::2])
