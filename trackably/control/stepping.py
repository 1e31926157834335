"""What a closed loop needs of a controller, and of what disturbs it; the arguments of a step, checked."""

from typing import NamedTuple, Protocol

import numpy as np

from trackably.arguments import numbers, whole
from trackably.arrays import Array, ArrayLike
from trackably.control.references import TrackedReference, check_reference
from trackably.control.step.result import StepResult
from trackably.systems.constrained import ConstrainedSystem


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

    def step(
        self, k: int, state: ArrayLike, reference: TrackedReference, initial_guess: ArrayLike | None = None
    ) -> StepResult:
        """Return a plan at step `k` from `state` (n,), or why there is none."""
        ...


class StepArguments(NamedTuple):
    """The step `k`, the `state` (n,), and the inputs `guess` (N, m) that a search begins with, if there is one."""

    k: int
    state: Array
    guess: Array | None

    @classmethod
    def checked(
        cls,
        k: int,
        state: ArrayLike,
        reference: TrackedReference,
        guess: ArrayLike | None,
        plant: ConstrainedSystem,
        horizon: int,
    ) -> "StepArguments":
        """Return the arguments of a step of a controller of a `plant`.

        Raises ValueError where the state is not n finite numbers, the guess has another shape, or the reference is of
        another system; TypeError where an argument is of another type.
        """
        n, m = len(plant.system.states), len(plant.system.inputs)
        k, state = whole("controller: k", k), numbers("controller: state", state)
        check_reference("controller", reference, plant)
        if state.shape != (n,) or not np.all(np.isfinite(state)):
            raise ValueError(f"controller: a state is {n} finite numbers, got {state.tolist()} at step {k}")
        if guess is not None:
            guess = numbers("controller: initial_guess", guess)
            if guess.shape != (horizon, m):
                raise ValueError(f"controller: initial_guess must have shape {(horizon, m)}, got {guess.shape}")
        return cls(k, state, guess)


class Disturbances(Protocol):
    """What is added to the state in each step of a simulation, or to what is measured of it."""

    def __call__(self, k: int, successor: Array) -> Array:
        """Return w(k) (n,), given what x(k + 1) would be without it; of noise, v(k), given x(k)."""
        ...
