"""The parts of a proved reference that exports need: values by name, proved times, and the times worth showing."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from trackably.arguments import numbers, whole
from trackably.arrays import Array, ArrayLike
from trackably.certificates.certificate import Certificate
from trackably.certificates.claim import AllPhases, AllTimes, AtInstants, OnWindow
from trackably.control.angles import angles_of
from trackably.gp.samples import Samples
from trackably.systems.pieces import PolynomialPieces
from trackably.systems.reference import Reference
from trackably.systems.trajectories import Quantity


class Proved(Protocol):
    """A `reference`, the `certificate` that it keeps its bounds, and the samples that it was
    learned from, by name of the state.
    """

    @property
    def reference(self) -> Reference: ...

    @property
    def certificate(self) -> Certificate: ...

    @property
    def explanation(self) -> str: ...

    @property
    def sampled(self) -> Mapping[str, Samples]: ...


def proved_times(proved: Proved, times: ArrayLike) -> Array:
    """Return times t [s] as an array of float64, of any shape.

    TypeError: they are no numbers. ValueError: a time is not proved.
    """
    t = numbers("times", times)
    if (found := proved.certificate.first_unproved(t)) is not None:
        i, why = found
        raise ValueError(f"t = {t.flat[i]:g} s is {why}; `reference.reference` has values there, without any guarantee")
    return t


def proved_steps(proved: Proved, first: int, count: int) -> Array:
    """Return the steps k = `first`, …, `first` + `count` − 1. ValueError: a step is not proved."""
    k = whole("first", first) + np.arange(float(whole("count", count, least=1)))
    proved_times(proved, proved.reference.instants(k))
    return k


_MOST = 2000
_TINY_PART = 1e-9  # relative to the length of the times shown


@dataclass(frozen=True)
class Reached:
    """A bounded `quantity` with its `values` at the `times` shown."""

    quantity: Quantity
    times: Array
    values: Array

    @property
    def least(self) -> tuple[float, float]:
        """The least margin found, in the unit of the quantity, and its time [s]."""
        margins = self.quantity.bounds.margin(self.values)
        i = int(np.argmin(margins))
        return float(margins[i]), float(self.times[i])


def ends(proved: Proved) -> tuple[float, float]:
    """Return the first and the last time [s] worth showing, within the claim.

    If all times are proved, the last one is when the reference has settled, but at most twice the time of its last
    kernel or piece: kernels with heavy tails are near their bounds for hours, and hardly move.
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
    """Return `count` times [s] between the ends; sampled instants if only these are proved."""
    first, last = (given if given is not None else left for given, left in zip((start, end), ends(proved), strict=True))
    if not first < last:
        raise ValueError(f"plot: needs start < end, got {first:g} s and {last:g} s")
    if not isinstance(proved.certificate.claim, AtInstants):
        return np.linspace(first, last, count)
    sampling_time = proved.reference.plant.sampling_time
    from_step, to_step = np.ceil(first / sampling_time - _TINY_PART), np.floor(last / sampling_time + _TINY_PART)
    stride = max(1, int(np.ceil((to_step - from_step) / count)))
    return np.asarray(proved.reference.instants(np.arange(from_step, to_step + 1, stride)))


def margins_found(proved: Proved) -> list[Reached]:
    """Return all bounded quantities at up to 2000 times: evidence of their margins, in addition to the proof."""
    times = shown_times(proved, _MOST)
    signals = proved.reference.signals
    return [Reached(quantity, times, quantity(signals, times)) for quantity in proved.reference.quantities]


_TINY = 1e-9  # of a sampling time


def places(proved: Proved) -> dict[str, int]:
    """Return the index of each name in the vector of states followed by inputs."""
    system = proved.reference.plant.system
    return {name: i for i, name in enumerate((*system.states, *system.inputs))}


def values_at(proved: Proved, steps: Array) -> Array:
    """Return states, then inputs, at consecutive steps k: shape (*k.shape, n + m). Angles do not jump."""
    states = continuous(proved, proved.reference.state(steps))
    return np.concatenate([states, proved.reference.input(steps)], axis=-1)


def continuous(proved: Proved, states: Array) -> Array:
    """Return states (K, n) with whole turns added to the angles, so that they do not jump.

    A controller that follows a heading would turn around where it jumps from π to −π.
    """
    turned, angles = states.copy(), angles_of(proved.reference.plant)
    turned[:, angles] = np.unwrap(states[:, angles], axis=0)
    return turned


def chosen_steps(proved: Proved, first: int | None, count: int | None) -> Array:
    """Return `count` steps from `first` on, by default those worth showing.

    ValueError: a step is not proved.
    """
    start, end = (t / proved.reference.plant.sampling_time for t in ends(proved))
    begin = math.ceil(start - _TINY) if first is None else whole("first", first)
    number = max(math.floor(end + _TINY) - begin + 1, 1) if count is None else count
    return proved_steps(proved, begin, number)


def require_known(what: str, named: Mapping[str, object], proved: Proved) -> None:
    """Raise ValueError for the first name that is neither a state nor an input."""
    known = places(proved)
    if unknown := [name for name in named if name not in known]:
        raise ValueError(f"{what}: {unknown[0]} is neither a state nor an input ({', '.join(known)})")
