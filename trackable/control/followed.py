"""References that a controller may follow, learned or not."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from trackable.arrays import Array
from trackable.gp.samples import Samples
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.flat.trajectory import Coordinate
from trackable.systems.reference import Window


class Followed(Protocol):
    """All that a controller asks of a reference; a learned `Reference` is one."""

    def window(self, k: int, horizon: int) -> Window:
        """x_r(k), …, x_r(k + N) and u_r(k), …, u_r(k + N − 1) for N = `horizon`."""
        ...


@dataclass(frozen=True, eq=False)
class Interpolated:
    """Straight lines through samples of the flat outputs, held constant before the first and after the last one.

    Nothing is learned: this is what a controller would do with the samples themselves. Inputs follow by flatness, so
    that the system follows the lines exactly if it may; at their corners an input has to jump. Of samples that see a
    flat output z through a stencil, y(t) = offset + Σ_j w_j z(t + j T_s), the lines are those that would be seen as
    these samples if they had no corners. ValueError where a stencil sees changes only.
    """

    samples: tuple[Samples, ...]
    plant: ConstrainedSystem

    def __post_init__(self) -> None:
        if len(self.samples) != self.plant.signal_count:
            raise ValueError(f"reference: the system needs {self.plant.signal_count} signals, got {len(self.samples)}")
        _ = self._lines  # raise what it refuses

    def window(self, k: int, horizon: int) -> Window:
        """As of a learned reference."""
        t = (k + np.arange(horizon + 1.0)) * self.plant.sampling_time
        flat = self.plant.flatness
        return Window(self._values(flat.states, t), self._values(flat.inputs, t[:-1]))

    def _values(self, coordinates: tuple[Coordinate, ...], t: Array) -> Array:
        return np.stack([q(self._lines, t) for q in coordinates], axis=-1)

    @cached_property
    def _lines(self) -> list[Callable[[Array], Array]]:
        """Each flat output."""
        return [_line(*_seen_through(samples)) for samples in self.samples]


def _line(times: Array, values: Array) -> Callable[[Array], Array]:
    return lambda t: np.asarray(np.interp(t, times, values))


def _seen_through(samples: Samples) -> tuple[Array, Array]:
    """On a straight line Σ_j w_j z(t + j T) = W z(t + τ) with W = Σ_j w_j and τ = Σ_j w_j j T / W."""
    stencil, weights = samples.stencil, np.array(samples.stencil.weights)
    total = float(np.sum(weights))
    if abs(total) <= 1e-9 * float(np.sum(np.abs(weights))):
        raise ValueError("reference: the samples see only changes of a flat output, which leaves open where it is")
    delay = float(weights @ np.arange(len(weights))) / total * stencil.step
    return samples.times + delay, (samples.values - stencil.offset) / total


@dataclass(frozen=True, eq=False)
class Tabulated:
    """The window of another reference from step `first` on, evaluated at once instead of anew at each step."""

    first: int
    whole: Window

    @classmethod
    def of(cls, reference: Followed, first: int, last: int) -> "Tabulated":
        """For all windows that end at step `last` or before."""
        return cls(first, reference.window(first, last - first))

    def window(self, k: int, horizon: int) -> Window:
        """ValueError where the table does not reach."""
        start, end = k - self.first, k - self.first + horizon
        if not 0 <= start <= end <= len(self.whole.inputs):
            last = self.first + len(self.whole.inputs)
            raise ValueError(
                f"reference: tabulated from step {self.first} to {last}, got a window from {k} to {k + horizon}"
            )
        return Window(self.whole.states[start : end + 1], self.whole.inputs[start:end])
