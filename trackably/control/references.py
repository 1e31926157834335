"""References that a controller can track, learned or not."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from trackably.arrays import Array
from trackably.gp.samples import Samples
from trackably.gp.stencil import Stencil
from trackably.systems.constrained import ConstrainedSystem, System
from trackably.systems.flat.trajectory import Coordinate
from trackably.systems.reference import Window

_DRAWS, _ROUNDING = 8, 1e-9  # matrices may be computed again


class TrackedReference(Protocol):
    """All that a controller needs of a reference; a learned `Reference` has it."""

    def window(self, k: int, horizon: int) -> Window:
        """Return x_r(k), …, x_r(k + N) and u_r(k), …, u_r(k + N − 1) for N = `horizon`."""
        ...


def check_reference(what: str, given: object, plant: ConstrainedSystem) -> None:
    """Raise TypeError for what has no `window(k, horizon)`, and ValueError where it says that it is of another system.

    A reference says so by its `plant`, or by that of its `reference`. Which sets these are does not matter.
    """
    if not callable(getattr(given, "window", None)):
        raise TypeError(f"{what}: expected a reference, with `window(k, horizon)`, got {type(given).__name__}")
    of = getattr(getattr(given, "reference", given), "plant", None)
    if isinstance(of, ConstrainedSystem) and (other := _difference(of.system, plant.system)):
        raise ValueError(f"{what}: the reference is of another system than the controller: {other}")


def check_window(window: Window, shape: tuple[int, int, int]) -> None:
    """Raise ValueError for a window that is not of N steps with n states and m inputs, where `shape` is N, n, m."""
    N, n, m = shape
    if (shapes := [np.shape(values) for values in window]) != [(N + 1, n), (N, m)]:
        raise ValueError(
            f"controller: the reference must give states of shape {(N + 1, n)} and inputs of shape {(N, m)}, got "
            f"{' and '.join(map(str, shapes))}: it may be one of another system"
        )


def _difference(one: System, other: System) -> str:
    """Say in what two systems differ; "" where they are alike: by name, and by where they go from drawn states."""
    if one is other:
        return ""
    for what in ("states", "inputs", "sampling_time"):
        a, b = getattr(one, what), getattr(other, what)
        if a != b:
            a, b = (", ".join(of) if isinstance(of, tuple) else f"{of:g} s" for of in (a, b))
            return f"its {what} {a}, the controller's {b}"
    rng = np.random.default_rng(0)
    x, u = (rng.uniform(0.5, 1.5, (_DRAWS, len(names))) for names in (one.states, one.inputs))
    a, b = one.successor(x, u), other.successor(x, u)
    alike = np.isclose(a, b, rtol=_ROUNDING, atol=0.0, equal_nan=True).all(axis=0)
    return "" if alike.all() else f"from the same state and input, the next {one.states[np.argmin(alike)]} is another"


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


@dataclass(frozen=True, eq=False)
class TabulatedReference:
    """The values of another reference from step `first_step` on, evaluated once instead of at each step again."""

    first_step: int
    values: Window

    @classmethod
    def of(cls, reference: TrackedReference, first_step: int, last_step: int) -> "TabulatedReference":
        """Tabulate a reference for all windows between two steps."""
        return cls(first_step, reference.window(first_step, last_step - first_step))

    def window(self, k: int, horizon: int) -> Window:
        """Return the states and inputs of `horizon` steps from step `k` on. ValueError outside the table."""
        start, end = k - self.first_step, k - self.first_step + horizon
        if not 0 <= start <= end <= len(self.values.inputs):
            last = self.first_step + len(self.values.inputs)
            raise ValueError(
                f"reference: tabulated from step {self.first_step} to {last}, got a window from {k} to {k + horizon}"
            )
        return Window(self.values.states[start : end + 1], self.values.inputs[start:end])
