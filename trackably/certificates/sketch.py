"""Approximate margins in float64, and jumps of headings: they guide the proposals, and prove nothing."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from trackably.arrays import Array, subdivide
from trackably.certificates.outcome import Unproved
from trackably.checker.formulas import Angle, parts
from trackably.learning.index_set import AROUND, lowest_of_parabolas
from trackably.systems.formulas import evaluate_floats
from trackably.systems.pieces import PolynomialPieces
from trackably.systems.reference import Reference
from trackably.systems.trajectories import Quantities

_POINTS_PER_CORRELATION_TIME, _MOST_POINTS = 12, 50_000
_FEWEST_POINTS, _FEWEST_OF_FORMULAS = 65, 1025
_FEW_CENTRES = 100  # if a signal has at most this many, formulas are also examined at each of its centres
_TRIED = 8  # number of times with the smallest margins at which violations are sought
_REFINEMENTS, _NARROWER = 3, 0.1  # parabolas that refine a minimum, and the ratio of successive widths


@dataclass(frozen=True)
class Sketch:
    """Approximate `margins` of a quantity (distances from its nearest bound) at increasing `times` [s], shapes (n,)."""

    times: Array
    margins: Array

    @property
    def worst_times(self) -> list[float]:
        """The times [s] of the smallest margins, the smallest first; NaN, where a quantity is undefined, comes first.

        The first alone is not enough: at a jump, the exact value at this time may be on the side that keeps the bounds.
        """
        order = np.argsort(np.nan_to_num(self.margins, nan=-np.inf, posinf=np.inf, neginf=-np.inf), kind="stable")
        return [float(time) for time in self.times[order[:_TRIED]]]

    @property
    def least(self) -> float:
        """The smallest margin."""
        return float(np.min(self.margins))


def sketches(reference: Reference, start: float, end: float) -> list[Sketch]:
    """Return margins at many times and at their local minima. The times are the same for all quantities.

    For sums of kernels, the times are a regular grid, and centres near which margins may change between times of the
    grid. For pieces, they are the ends of the pieces, and times in between.
    """
    every, times = (_of_pieces if reference.pieces else _of_kernels)(reference, start, end)
    margins = every.margins(times)
    lowest = np.clip(refine(every, times, margins), start, end)
    times, once = np.unique(np.concatenate([times, lowest]), return_index=True)
    margins = np.concatenate([margins, every.margins(lowest)], axis=1)[:, once]
    return [Sketch(times, of) for of in margins]


def _of_kernels(reference: Reference, start: float, end: float) -> tuple[Quantities, Array]:
    """Return the quantities in float64, and the times [s] at which they are examined first."""
    quantities, of_signals = reference.quantities, reference.kernel_sums
    every = Quantities(quantities, of_signals)
    shortest = min(signal.kernel.correlation_time for signal in of_signals)
    fewest = _FEWEST_POINTS if every.is_linear else _FEWEST_OF_FORMULAS
    count = int(np.clip(_POINTS_PER_CORRELATION_TIME * (end - start) / shortest, fewest, _MOST_POINTS))
    most = 0 if every.is_linear else _FEW_CENTRES  # formulas may have narrow minima at centres
    near_change = [of.centres for of in of_signals if not of.kernel.is_analytic or len(of.centres) <= most]
    centres = np.subtract.outer(np.concatenate([np.empty(0), *near_change]), _shifts(reference)).ravel()
    times = np.unique(np.concatenate([np.linspace(start, end, count), every.breakpoints_in(start, end), centres]))
    return every, times[(start <= times) & (times <= end)]


def _of_pieces(reference: Reference, start: float, end: float) -> tuple[Quantities, Array]:
    every = Quantities(reference.quantities, [signal.summed for signal in reference.pieces])
    times = times_to_look_at(reference.pieces, _shifts(reference), start, end)
    return every, np.union1d(times, every.breakpoints_in(start, end))


def _shifts(reference: Reference) -> Array:
    """Return all shifts j T_s [s] of signals on which states and inputs depend."""
    return np.asarray(reference.plant.sampling_time * np.arange(max(reference.plant.flatness.orders) + 1.0))


def times_to_look_at(signals: Sequence[PolynomialPieces], shifts: Array, start: float, end: float) -> Array:
    """Return increasing times [s]: the ends of shifted pieces, their neighbours in float64, and times in between."""
    breaks = [np.array([start, end])]
    for signal in signals:
        ends, turns = signal.breakpoints, np.zeros(1)
        if signal.beyond == "period":
            last = math.floor((end + shifts[-1] - ends[0]) / signal.period)
            turns = np.arange(math.floor((start - ends[0]) / signal.period), last + 1.0)
        breaks.append(np.subtract.outer(np.add.outer(ends, turns * signal.period), shifts).ravel())
    inner = np.unique(np.clip(np.concatenate(breaks), start, end))
    between = subdivide(inner, 2 * max(signal.degree for signal in signals) + 4)
    beside = [np.nextafter(inner, -np.inf), np.nextafter(inner, np.inf)]
    return np.unique(np.clip(np.concatenate([between, *beside]), start, end))


def refine(every: Quantities, times: Array, margins: Array) -> Array:
    """Return the times [s] of local minima of `margins`, refined by parabolas through three points, ever closer."""
    inner = margins[:, 1:-1]
    which, at = np.nonzero((inner < margins[:, :-2]) & (inner <= margins[:, 2:]))
    lowest, reach = times[at + 1], (times[at + 2] - times[at]) / 2
    for _ in range(_REFINEMENTS):
        centre = np.clip(lowest, times[at] + reach, times[at + 2] - reach)
        lowest, _ = lowest_of_parabolas(lowest, centre, reach, every.margins_of(which, centre + reach * AROUND))
        reach = reach * _NARROWER
    return lowest


JUMP = (
    "its formula takes the angle of a vector that crosses the direction of ±π, where it jumps; a heading does not jump "
    "inside of bounds that are up to 6.1 rad wide, and without bounds it may turn freely"
)


def jump_of(reference: Reference, times: Array) -> Unproved | None:
    """Return a failure if a heading jumps between two of the increasing `times` [s]; None if no jump is seen.

    The heading atan2(y, x) jumps by a whole turn where y changes its sign while x < 0.
    """
    signals = [signal.summed for signal in reference.signals]
    for quantity in reference.quantities:
        for node in parts(quantity.trajectory.formula):
            if isinstance(node, Angle):
                arguments = {name: q(signals, times) for name, q in quantity.trajectory.arguments}
                y, x = (np.broadcast_to(evaluate_floats(of, arguments), times.shape) for of in (node.y, node.x))
                (before,) = np.nonzero((y[1:] > 0) != (y[:-1] > 0))
                y_before, x_before = y[before], x[before]
                x_between = x_before + (x[before + 1] - x_before) * y_before / (y_before - y[before + 1])
                for i in before[x_between < 0].tolist():
                    box = float(times[i]), float(times[i + 1])
                    return Unproved(quantity.name, quantity.bounds, box, np.inf, JUMP)
    return None
