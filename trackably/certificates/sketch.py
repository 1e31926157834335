"""Approximate margins in float64, and jumps of headings: they guide the proposals, and prove nothing."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from trackably.arrays import Array
from trackably.certificates.outcome import Unproved
from trackably.checker.formulas import Angle, Formula, parts
from trackably.gp.signal import Remembered
from trackably.systems.formulas import evaluate_floats
from trackably.systems.reference import Reference
from trackably.systems.trajectories import Indices, Quantities, Quantity, Signals, Trajectory

_POINTS_PER_CORRELATION_TIME, _MOST_POINTS = 12, 50_000
_FEWEST_POINTS, _FEWEST_OF_FORMULAS = 65, 1025
_FEW_CENTRES = 100
_REFINEMENTS, _NARROWER, _AROUND = 2, 0.1, np.array([[-1.0], [0.0], [1.0]])


@dataclass(frozen=True)
class Sketch:
    """Margins of a quantity at increasing times [s], and |∂q/∂q_i| for each of its functionals; all of shape (n,).

    A slope that is the same at all times has shape (1,).
    """

    times: Array
    margins: Array
    slopes: dict[str, Array]

    def within(self, starts: Array, ends: Array) -> "Extremes":
        """Return the smallest margin in each [start, end], at grid times and, interpolated, at the ends.

        And the largest slopes.

        Slopes include one more grid time on either side.
        """
        first, last = np.searchsorted(self.times, starts), np.searchsorted(self.times, ends)
        at_ends = np.interp([starts, ends], self.times, self.margins)
        # Interpolation next to an infinite margin gives NaN, which must not count as a violation.
        smallest = np.fmin(np.fmin(*at_ends), _over(np.minimum, self.margins, first, last))
        further = np.maximum(first - 1, 0), last + 1
        return Extremes(smallest, {name: _over(np.maximum, slopes, *further) for name, slopes in self.slopes.items()})

    @property
    def worst_time(self) -> float:
        return float(self.times[np.argmin(self.margins)])

    @property
    def least(self) -> float:
        """The smallest margin."""
        return float(np.min(self.margins))


class Extremes(NamedTuple):
    """The smallest margin in each box, and the largest |∂q/∂q_i|: shape (B,), or (1,) if it is
    the same in all boxes.
    """

    smallest: Array
    steepest: dict[str, Array]


def sketches(reference: Reference, start: float, end: float) -> list[Sketch]:
    """Return margins on a regular grid, at their local minima, and near centres where they may
    change between grid times.

    The times are the same for all quantities.
    """
    quantities, of_signals, length = reference.quantities, reference.kernel_sums, end - start
    every = Quantities(quantities, [signal.nearly for signal in of_signals])
    if not every.is_linear:  # each formula evaluates the signals for itself
        every = Quantities(quantities, Remembered.of(of_signals).signals)
    shortest = min(signal.kernel.correlation_time for signal in of_signals)
    grid = np.linspace(start, end, _points(length / shortest, every.is_linear))
    times = _with_centres(reference, np.union1d(grid, every.breakpoints_in(start, end)), every.is_linear)
    margins = every.margins(times)
    lowest = refine(every, times, margins)
    times, once = np.unique(np.concatenate([times, lowest]), return_index=True)
    margins = np.concatenate([margins, every.margins(lowest)], axis=1)[:, once]
    pairs = zip(quantities, margins, strict=True)
    return [Sketch(times, of, _sizes(quantity, every.signals, times)) for quantity, of in pairs]


def _points(correlation_times: float, is_linear: bool) -> int:
    """Return the number of grid points of a window, from its length in correlation times."""
    fewest = _FEWEST_POINTS if is_linear else _FEWEST_OF_FORMULAS
    return int(np.clip(_POINTS_PER_CORRELATION_TIME * correlation_times, fewest, _MOST_POINTS))


def refine(every: Quantities, times: Array, margins: Array) -> Array:
    """Return local minima by parabolas: first through the three grid points around each, then through closer points."""
    inner = margins[:, 1:-1]
    which, at = np.nonzero((inner < margins[:, :-2]) & (inner <= margins[:, 2:]))
    around = at + np.arange(3)[:, None]
    lowest = _lowest(times[around], margins[which, around])
    reach = np.minimum(times[at + 2] - times[at + 1], times[at + 1] - times[at])
    for _ in range(_REFINEMENTS):
        reach = reach * _NARROWER
        closer = np.clip(lowest, times[at] + reach, times[at + 2] - reach) + reach * _AROUND
        lowest = np.clip(_lowest(closer, every.margins_of(which, closer)), closer[0], closer[2])
    return lowest


def _lowest(times: Array, margins: Array) -> Array:
    """Return the minima of parabolas through three points each; the middle point if a parabola has no minimum."""
    (before, at, after), (left, middle, right) = times, margins
    with np.errstate(all="ignore"):  # margins may be infinite
        falls, rises = (after - at) * (left - middle), (at - before) * (right - middle)
        step = ((after - at) * falls - (at - before) * rises) / (2 * (falls + rises))
    return np.asarray(np.where(np.isfinite(step) & (falls + rises > 0), at + step, at))


def _sizes(quantity: Quantity, signals: Signals, times: Array) -> dict[str, Array]:
    """Return |∂q/∂q_i| for each functional."""
    trajectory = quantity.trajectory
    if trajectory.functional:
        return {name: np.ones(1) for name, _ in trajectory.arguments}
    slopes = trajectory.slopes({name: functional(signals, times) for name, functional in trajectory.arguments})
    return {name: np.broadcast_to(np.abs(slope), times.shape) for name, slope in slopes.items()}


def _with_centres(reference: Reference, grid: Array, is_linear: bool) -> Array:
    """Add the times at which a quantity depends on a centre, for short length scales, and for kernels with kinks.

    For a smooth kernel they are left out if it has many centres, as the grid then shows all changes. They are also left
    out if the grid is fine and quantities are linear.
    """
    centres, is_fine = [grid], is_linear and len(grid) < _MOST_POINTS
    for quantity in reference.quantities:
        for _, functional in quantity.trajectory.arguments:
            for c, weights in functional.rounded:
                signal = reference.kernel_sums[c]
                if not (signal.kernel.is_analytic and (is_fine or len(signal.centres) > _FEW_CENTRES)):
                    steps = functional.sampling_time * np.arange(len(weights))
                    centres.append((signal.centres[:, None] - steps).ravel())
    if len(centres) == 1:
        return grid
    times = np.unique(np.concatenate(centres))
    return np.asarray(times[(times >= grid[0]) & (times <= grid[-1])])


def _over(extreme: np.ufunc, values: Array, first: Indices, last: Indices) -> Array:
    """Return the extremes (`extreme`: minima or maxima) of `values`[first:last]; of an empty slice, `values`[first]."""
    if len(values) == 1:
        return values
    within = np.stack([first, np.minimum(last, len(values))], axis=1).ravel()
    return np.asarray(extreme.reduceat(np.append(values, values[-1:]), within)[::2])


JUMP = (
    "its formula takes the angle of a vector that crosses the direction of ±π, where it jumps; a heading does not jump "
    "inside of bounds that are up to 6.1 rad wide, and without bounds it may turn as it likes"
)
_HALVINGS = 50


def jump_of(reference: Reference, sketches: Sequence[Sketch]) -> Unproved | None:
    """Return a failure if a heading in one of the quantities jumps; None if no jump is seen.

    `sketches` are in their order.
    """
    signals = [signal.summed for signal in reference.kernel_sums]
    for quantity, drawn in zip(reference.quantities, sketches, strict=True):
        if (time := _first_jump(quantity.trajectory, signals, drawn.times)) is not None:
            return Unproved(quantity.name, quantity.bounds, (time, time), np.inf, JUMP)
    return None


def _first_jump(trajectory: Trajectory, signals: Signals, times: Array) -> float | None:
    """Return the time [s] at which an angle in the formula jumps, near one of some increasing `times` [s].

    None if none.
    """

    def along(formula: Formula) -> Callable[[Array], Array]:
        return lambda t: evaluate_floats(formula, {name: q(signals, t) for name, q in trajectory.arguments})

    for node in parts(trajectory.formula):
        if isinstance(node, Angle) and (found := _jump(along(node.y), along(node.x), times)) is not None:
            return found
    return None


def _jump(y: Callable[[Array], Array], x: Callable[[Array], Array], times: Array) -> float | None:
    """Return a time [s] at which y changes its sign while x < 0; None if there is none."""
    above, behind = (np.broadcast_to(part, times.shape) for part in (y(times) > 0, x(times) < 0))
    for i in np.flatnonzero((above[1:] != above[:-1]) & behind[1:]).tolist():
        left, right = times[i], times[i + 1]
        for _ in range(_HALVINGS):
            middle = left + (right - left) / 2
            left, right = (middle, right) if (y(middle) > 0) == above[i] else (left, middle)
        if x(left) < 0:
            return float(left)
    return None
