"""What a closed loop needs of a controller, and of what disturbs it."""

from typing import Protocol

from trackable.arrays import Array
from trackable.control.references import TrackedReference
from trackable.control.step.result import StepResult
from trackable.systems.constrained import ConstrainedSystem


class SteppedController(Protocol):
    """A controller with a horizon N: `Controller`, or `TubeController`."""

    @property
    def plant(self) -> ConstrainedSystem:
        """The system that is controlled, with its sets."""
        ...

    @property
    def horizon(self) -> int:
        """N, in steps."""
        ...

    def step(self, k: int, state: Array, reference: TrackedReference, initial_guess: Array | None = None) -> StepResult:
        """Return a plan at step `k` from `state` (n,), or why there is none."""
        ...


class Disturbances(Protocol):
    """What is added to the state in each step of a simulation, or to what is measured of it."""

    def __call__(self, k: int, successor: Array) -> Array:
        """Return w(k) (n,), given what x(k + 1) would be without it; of noise, v(k), given x(k)."""
        ...
