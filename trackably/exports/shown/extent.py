"""The times at which a reference is shown, and how near its quantities come to their bounds there."""

from dataclasses import dataclass

import numpy as np

from trackably.arrays import Array
from trackably.certificates.claim import AllPhases, AllTimes, AtInstants, OnWindow
from trackably.exports.proved import Proved
from trackably.systems.quantity import Quantity
from trackably.systems.signals.pieces import PolynomialPieces

_MOST = 2000
_TINY = 1e-9  # of the length of the times shown


@dataclass(frozen=True)
class Reached:
    """A bounded `quantity` at the times that are shown: its `values`, and where it is nearest to a bound."""

    quantity: Quantity
    times: Array
    values: Array

    @property
    def least(self) -> tuple[float, float]:
        """The least margin that was found, in the unit of the quantity, and its time [s]."""
        margins = self.quantity.bounds.margin(self.values)
        i = int(np.argmin(margins))
        return float(margins[i]), float(self.times[i])


def ends(proved: Proved) -> tuple[float, float]:
    """Return from when to when a reference is worth showing [s], within what is proved.

    Where all times are proved, this is until it is settled, and not longer than twice what it is made of: kernels with
    heavy tails are near their bounds for hours, and hardly move.
    """
    match proved.certificate.claim:
        case OnWindow(start, end):
            return start, end
        case AllPhases(period):
            return 0.0, period
        case AllTimes(tail_start):
            return 0.0, min(tail_start, _twice(proved))
        case AtInstants(last_step):
            return 0.0, min(float(proved.reference.instants(max(last_step, 1))), _twice(proved))


def _twice(proved: Proved) -> float:
    """Return twice the time of the last kernel or piece [s], and 200 sampling times at least."""
    signals = proved.reference.signals
    lasts = [z.breakpoints[-1] if isinstance(z, PolynomialPieces) else np.max(z.centres) for z in signals]
    return 2 * max(*map(float, lasts), 100 * proved.reference.plant.sampling_time)


def shown_times(proved: Proved, count: int, start: float | None = None, end: float | None = None) -> Array:
    """Return `count` times [s] between the ends; only the sampled instants, where no others are proved."""
    first, last = (given if given is not None else left for given, left in zip((start, end), ends(proved), strict=True))
    if not first < last:
        raise ValueError(f"plot: needs start < end, got {first:g} s and {last:g} s")
    if not isinstance(proved.certificate.claim, AtInstants):
        return np.linspace(first, last, count)
    sampling_time = proved.reference.plant.sampling_time
    from_step, to_step = np.ceil(first / sampling_time - _TINY), np.floor(last / sampling_time + _TINY)
    stride = max(1, int(np.ceil((to_step - from_step) / count)))
    return np.asarray(proved.reference.instants(np.arange(from_step, to_step + 1, stride)))


def reached(proved: Proved) -> list[Reached]:
    """Return all bounded quantities at up to 2000 times: evidence of how near they come, beside what is proved."""
    times = shown_times(proved, _MOST)
    signals = proved.reference.signals
    return [Reached(quantity, times, quantity(signals, times)) for quantity in proved.reference.quantities]
