"""Times at which margins seem smallest in float64: they guide the proposals, and prove nothing."""

import math
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from trackably.arrays import Array, subdivide
from trackably.checker.certificate import Claim, Instants, Window
from trackably.learning.index_set import RealTimes, Steps, TimesAndMargins
from trackably.systems.pieces import PolynomialPieces
from trackably.systems.reference import Reference
from trackably.systems.trajectories import Quantities

_CLOSER, _POINTS = 9, 33  # steps of the search for the smallest margin of pieces, and times in each


def lowest_margins(reference: Reference, claim: Claim, start: float, end: float) -> list[TimesAndMargins]:
    """Return, for each quantity, times from `start` to `end` [s] and margins (distances from the nearest bound) there.

    The times are close to that of the smallest margin; if only instants are claimed, they are those of local minima.
    """
    plant, signals = reference.plant, reference.signals
    every, T = Quantities(reference.quantities, signals), plant.sampling_time
    if reference.pieces:
        shifts = T * np.arange(max(plant.flatness.orders) + 1.0)
        times = np.union1d(times_to_look_at(reference.pieces, shifts, start, end), every.breakpoints_in(start, end))
        return [approach(partial(quantity.margin, signals), times) for quantity in reference.quantities]
    kernels = [signal.kernel for signal in reference.kernel_sums]
    with np.errstate(all="ignore"):  # times of a short window may be equal in float64, and formulas undefined
        if isinstance(claim, Instants):
            return Steps(0, math.ceil(end / T), T).minima_of_each(every, kernels)
        minima = zip(reference.quantities, RealTimes(Window(start, end)).minima_of_each(every, kernels), strict=True)
        return [approach(partial(q.margin, signals), np.union1d(times, [start, end])) for q, (times, _) in minima]


def approach(margin: Callable[[Array], Array], times: Array) -> TimesAndMargins:
    """Return increasing times [s] close to the smallest of the margins at the given `times`, and the margins there."""
    for _ in range(_CLOSER):
        i = int(np.argmin(margin(times)))
        before, after = times[max(i - 1, 0)], times[min(i + 1, len(times) - 1)]
        times = np.union1d(np.linspace(before, after, _POINTS), times[i])
    return times, margin(times)


def times_to_look_at(signals: Sequence[PolynomialPieces], shifts: Array, start: float, end: float) -> Array:
    """Return increasing times [s]: the ends of shifted pieces, their neighbours in float64, and times in between."""
    breaks = [np.array([start, end])]
    for signal in signals:
        breaks.append(np.subtract.outer(signal.breakpoints_in(start, end + shifts[-1]), shifts).ravel())
    inner = np.unique(np.clip(np.concatenate(breaks), start, end))
    between = subdivide(inner, 2 * max(signal.degree for signal in signals) + 4)
    beside = [np.nextafter(inner, -np.inf), np.nextafter(inner, np.inf)]
    return np.unique(np.clip(np.concatenate([between, *beside]), start, end))
