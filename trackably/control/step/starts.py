"""Where a search for a plan starts: trajectories that keep all bounds, whether the system follows them or not."""

from collections.abc import Iterator

import numpy as np

from trackably.arrays import Array
from trackably.control.step.formulation import Formulation
from trackably.systems.constrained import System
from trackably.systems.reference import Window


def starts(formulation: Formulation, state: Array, window: Window, initial_guess: Array | None) -> Iterator[Window]:
    """Yield trajectories from `state` (n,) to the end of the reference's `window`, the most promising first.

    They are what the system does under the inputs `initial_guess` (N, m); the reference; what the system does under the
    reference's inputs; a straight line with these inputs; and what the system does under the middle of the input set.
    """
    system, N = formulation.plant.system, formulation.horizon
    middle = np.tile(formulation.admissible.centre, (N, 1))
    line = np.linspace(state, window.states[-1], N + 1)
    if initial_guess is not None:
        yield between(formulation, apply_inputs(system, state, initial_guess), state, window)
    for trajectory in (
        window,
        apply_inputs(system, state, window.inputs),
        Window(line, window.inputs),
        apply_inputs(system, state, middle),
    ):
        yield between(formulation, trajectory, state, window)


def between(formulation: Formulation, trajectory: Window, state: Array, window: Window) -> Window:
    """Return a trajectory from `state` to the end of `window`, with inputs and inner states pulled into their sets.

    Where a state is not finite, the reference's is taken.
    """
    defined = np.all(np.isfinite(trajectory.states), axis=1)[:, None]
    inner = [
        formulation.admissible_states.pull_inside(x) for x in np.where(defined, trajectory.states, window.states)[1:-1]
    ]
    inputs = [formulation.admissible.pull_inside(u) for u in trajectory.inputs]
    return Window(np.vstack([state, *inner, window.states[-1]]), np.array(inputs))


def apply_inputs(system: System, state: Array, inputs: Array) -> Window:
    """Simulate the system from `state` (n,) under `inputs` (N, m)."""
    states = [state]
    for u in inputs:
        states.append(system.successor(states[-1], u))
    return Window(np.array(states), inputs)
