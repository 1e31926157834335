"""Simulate the closed loop of a controller and its system."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from reprlib import repr as short

import numpy as np

from trackably.arguments import numbers, whole
from trackably.arrays import Array, ArrayLike
from trackably.control.angles import nearest_turns
from trackably.control.closed_loop import ClosedLoop
from trackably.control.references import TabulatedReference, TrackedReference, check_reference
from trackably.control.repeated_steps import RepeatedSteps
from trackably.control.step.result import Infeasible, Plan, Status, StepResult, Unsolved
from trackably.control.stepping import Disturbances, SteppedController
from trackably.systems.constrained import ConstrainedSystem

InfeasibilityPolicy = Callable[[Infeasible | Unsolved], Array | None]
"""Returns the input (m,) to apply where the controller finds no plan; None ends the simulation."""


def stop(_: Infeasible | Unsolved) -> None:
    """End the simulation where the controller finds no plan."""


def apply_fallback(result: Infeasible | Unsolved) -> Array:
    """Apply the first input of the plan that comes closest to the terminal constraint, or one that is admissible."""
    return result.fallback


def apply_fallback_for(steps: int) -> InfeasibilityPolicy:
    """Return a policy for one simulation: `apply_fallback` for a number of steps in all, then `stop`."""
    remaining = iter(range(steps))
    return lambda result: None if next(remaining, None) is None else apply_fallback(result)


def simulate(
    controller: SteppedController,
    reference: TrackedReference,
    initial_state: ArrayLike,
    steps: int,
    *,
    first_step: int = 0,
    on_infeasible: InfeasibilityPolicy = stop,
    disturbances: Disturbances | None = None,
    noise: Disturbances | None = None,
) -> ClosedLoop:
    """Simulate the closed loop from `initial_state` (n,) at `first_step`, for `steps` steps.

    The simulated system is the controller's own model, `controller.plant`, with `disturbances` added to each of its
    states; left out, there are none. The controller is given the state with `noise` added to it; states of the loop are
    the true ones. Where the controller finds no plan, `on_infeasible` chooses the input, or ends the simulation early:
    `stop`, `apply_fallback` and `apply_fallback_for(steps)` are such functions. The simulation also ends, as unsolved,
    where an input leads out of what the system's formulas define.

    Raises as `Controller.step` and as `reference.window`; TypeError and ValueError where disturbances or noise are no
    function, or no n numbers.
    """
    if not callable(getattr(controller, "step", None)):
        raise TypeError(f"simulate: controller: expected a Controller(plant, horizon, Q, R), got {controller!r}")
    check_reference("simulate", reference, controller.plant)
    first_step, steps = whole("simulate: first_step", first_step), whole("simulate: steps", steps, least=0)
    table = TabulatedReference.of(reference, first_step, first_step + steps + controller.horizon + 1)
    repeated, initial_guess = RepeatedSteps(controller), None
    course = _Course([numbers("simulate: initial_state", initial_state)])
    for k in range(first_step, first_step + steps):
        seen = course.state if noise is None else course.state + _drawn("noise", noise, k, course.state)
        result = repeated.step(k, seen, table, initial_guess)
        initial_guess = shifted_inputs(result, table) if isinstance(result, Plan) else None
        course.decided(result)
        applied = result.input if isinstance(result, Plan) else on_infeasible(result)
        if applied is None:
            break
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            successor = controller.plant.system.successor(course.state, applied)
            if disturbances is not None:
                successor = successor + _drawn("disturbances", disturbances, k, successor)
        if not np.all(np.isfinite(successor)):
            course.decided(Unsolved(k, "the system is not defined under the input applied", applied))
            break
        course.went(result, applied, successor)
    return course.closed_loop(controller.plant, table, first_step)


@dataclass
class _Course:
    """What a simulation has gone through so far: `states` and, for each but the last, input and costs."""

    states: list[Array]
    inputs: list[Array] = field(default_factory=list)
    values: list[tuple[float, float, float]] = field(default_factory=list)
    without_plan: list[Infeasible | Unsolved] = field(default_factory=list)
    widened: int = 0

    @property
    def state(self) -> Array:
        """Where the system is now, shape (n,)."""
        return self.states[-1]

    def decided(self, result: StepResult) -> None:
        """Note what the controller has decided, or why it could not."""
        if isinstance(result, Plan):
            self.widened += result.status is Status.WIDENED
        else:
            self.without_plan.append(result)

    def went(self, result: StepResult, applied: Array, successor: Array) -> None:
        """Note a step that was taken, with the costs of its plan; NaN where there was none."""
        of_plan = (result.cost, result.stage_cost, result.slack) if isinstance(result, Plan) else None
        self.values.append(of_plan or (np.nan, np.nan, np.nan))
        self.inputs.append(applied)
        self.states.append(successor)

    def closed_loop(self, plant: ConstrainedSystem, reference: TrackedReference, first_step: int) -> ClosedLoop:
        """Return all of it, beside the reference."""
        count, states = len(self.inputs), np.array(self.states)
        costs, stage_costs, slacks = np.array(self.values, dtype=float).reshape(count, 3).T
        tracked = reference.window(first_step, count)
        return ClosedLoop(
            first_step=first_step,
            states=states,
            inputs=np.array(self.inputs).reshape(count, len(plant.system.inputs)),
            reference_states=nearest_turns(plant, tracked.states, states),
            reference_inputs=tracked.inputs,
            costs=costs,
            stage_costs=stage_costs,
            slacks=slacks,
            without_plan=tuple(self.without_plan),
            widened=self.widened,
        )


def _drawn(what: str, of: Disturbances, k: int, state: Array) -> Array:
    """Return what is added to a state. Other shapes are refused, as NumPy would spread a number over all states."""
    if not callable(of):
        raise TypeError(f"simulate: {what}: expected a function of the step k and the state, got {short(of)}")
    added = numbers(f"simulate: {what}", of(k, state))
    if added.shape != state.shape:
        raise ValueError(f"simulate: {what}: expected {state.size} numbers at step {k}, got shape {added.shape}")
    return added


def shifted_inputs(plan: Plan, reference: TrackedReference) -> Array:
    """Return the inputs (N, m) of a plan from its second on, continued with the reference's own input.

    They are admissible at step k + 1 wherever the reference is trackable, and thus a good initial guess there.
    """
    end = plan.k + len(plan.inputs)
    return np.vstack([plan.inputs[1:], reference.window(end, 1).inputs])
