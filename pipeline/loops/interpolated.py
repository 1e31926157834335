"""A reference without learning: lines between the samples."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from trackably.arrays import Array
from trackably.gp.samples import Samples
from trackably.gp.stencil import Stencil
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.reference import Window
from trackably.systems.trajectories import Coordinate


@dataclass(frozen=True, eq=False)
class InterpolatedReference:
    """Linear interpolation of samples of the flat outputs, constant before the first sample and after the last one.

    Nothing is learned: this is what a controller would track without learning. The inputs follow by flatness, so that
    the system tracks the lines exactly where the inputs are admissible; they jump at the corners. Where samples
    measure a flat output z through a stencil, y(t) = offset + Σ_j w_j z(t + j T_s), the lines are those whose
    measurement gives the samples, corners aside. Raises ValueError where the number of samples is not that of the flat
    outputs, and where a stencil measures changes only (Σ_j w_j = 0).
    """

    samples: tuple[Samples, ...]
    plant: ConstrainedSystem

    def __post_init__(self) -> None:
        if len(self.samples) != self.plant.signal_count:
            raise ValueError(f"reference: the system needs {self.plant.signal_count} signals, got {len(self.samples)}")
        _ = self._lines  # raises where a stencil measures changes only

    def window(self, k: int, horizon: int) -> Window:
        """Return the states and inputs of `horizon` steps from step `k` on."""
        t = (k + np.arange(horizon + 1.0)) * self.plant.sampling_time
        flat = self.plant.flatness
        return Window(self._values(flat.states, t), self._values(flat.inputs, t[:-1]))

    def _values(self, coordinates: tuple[Coordinate, ...], t: Array) -> Array:
        return np.stack([q(self._lines, t) for q in coordinates], axis=-1)

    @cached_property
    def _lines(self) -> list[Callable[[Array], Array]]:
        """One function of time [s] for each flat output."""
        return [_line(*_flat_samples(samples)) for samples in self.samples]


def _line(times: Array, values: Array) -> Callable[[Array], Array]:
    return lambda t: np.asarray(np.interp(t, times, values))


def _flat_samples(samples: Samples) -> tuple[Array, Array]:
    """Return times [s] and values of the flat output z that a straight line has where the samples are measured.

    On a straight line Σ_j w_j z(t + j T) = W z(t + τ) with W = Σ_j w_j and τ = Σ_j w_j j T / W.
    """
    samples = samples.of_level
    if not isinstance(stencil := samples.stencil, Stencil):
        raise ValueError("reference: the samples see only changes of a flat output, which leaves open where it is")
    weights = np.array(stencil.weights)
    total = float(np.sum(weights))
    if abs(total) <= 1e-9 * float(np.sum(np.abs(weights))):
        raise ValueError("reference: the samples see only changes of a flat output, which leaves open where it is")
    delay = float(weights @ np.arange(len(weights))) / total * stencil.step
    return samples.times + delay, (samples.values - stencil.offset) / total
