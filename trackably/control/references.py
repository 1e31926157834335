"""References that a controller can track, learned or not."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from trackably.systems.constrained import ConstrainedSystem, System
from trackably.systems.reference import Window

_DRAWS, _ROUNDING = 8, 1e-9  # states drawn to compare systems; relative tolerance between their successors


class TrackedReference(Protocol):
    """The interface of a reference for controllers; a learned `Reference` implements it, and any class may."""

    def window(self, k: int, horizon: int) -> Window:
        """Return x_r(k), …, x_r(k + N) and u_r(k), …, u_r(k + N − 1) for N = `horizon`."""
        ...


def check_reference(what: str, given: object, plant: ConstrainedSystem) -> None:
    """Raise TypeError for an object without `window(k, horizon)`, and ValueError for a reference of another system.

    The system is that of `given.reference.plant`, or else of `given.plant`; if `given` has neither, no system is
    compared. Sets are never compared.
    """
    if not callable(getattr(given, "window", None)):
        raise TypeError(f"{what}: expected a reference, with `window(k, horizon)`, got {type(given).__name__}")
    of = getattr(getattr(given, "reference", given), "plant", None)
    if isinstance(of, ConstrainedSystem) and (other := _difference(of.system, plant.system)):
        raise ValueError(f"{what}: the reference is of another system than the controller: {other}")


def check_window(window: Window, shape: tuple[int, int, int]) -> None:
    """Raise ValueError unless a window has N steps with n states and m inputs, where `shape` is (N, n, m)."""
    N, n, m = shape
    if (shapes := [np.shape(values) for values in window]) != [(N + 1, n), (N, m)]:
        raise ValueError(
            f"controller: the reference must give states of shape {(N + 1, n)} and inputs of shape {(N, m)}, got "
            f"{' and '.join(map(str, shapes))}; it may belong to another system"
        )


def _difference(one: System, other: System) -> str:
    """Return how two systems differ, in names or in successors of randomly drawn states; "" if they are equal."""
    if one is other:
        return ""
    for what in ("states", "inputs", "sampling_time"):
        if (a := getattr(one, what)) != (b := getattr(other, what)):
            return f"its {what} {a}, the controller's {b}"
    rng = np.random.default_rng(0)
    x, u = (rng.uniform(0.5, 1.5, (_DRAWS, len(names))) for names in (one.states, one.inputs))
    a, b = one.successor(x, u), other.successor(x, u)
    alike = np.isclose(a, b, rtol=_ROUNDING, atol=0.0, equal_nan=True).all(axis=0)
    return "" if alike.all() else f"from the same state and input, the next {one.states[np.argmin(alike)]} differs"


@dataclass(frozen=True, eq=False)
class TabulatedReference:
    """The values of another reference from step `first_step` on, evaluated once in advance."""

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
