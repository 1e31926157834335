"""Simulate the closed loop of a controller and its system."""

from collections.abc import Callable
from reprlib import repr as short

import numpy as np

from trackable.arguments import numbers, whole
from trackable.arrays import Array, ArrayLike
from trackable.control.angles import nearest_turns
from trackable.control.closed_loop import ClosedLoop
from trackable.control.references import TabulatedReference, TrackedReference, check_reference
from trackable.control.repeated_steps import RepeatedSteps
from trackable.control.step.result import Infeasible, Plan, Status, Unsolved
from trackable.control.stepping import Disturbances, SteppedController

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
    the true ones. Where the controller finds no plan, `on_infeasible` chooses the input or ends the
    simulation early. The simulation also ends, as unsolved, where an input leads out of what the system's formulas
    define. Raises as `Controller.step` and as `reference.window`; TypeError and ValueError where disturbances or noise
    are no function, or no n numbers.
    """
    if not callable(getattr(controller, "step", None)):
        raise TypeError(f"simulate: controller: expected a Controller(plant, horizon, Q, R), got {controller!r}")
    check_reference("simulate", reference)
    first_step, steps = whole("simulate: first_step", first_step), whole("simulate: steps", steps, least=0)
    table = TabulatedReference.of(reference, first_step, first_step + steps + controller.horizon + 1)
    system, repeated = controller.plant.system, RepeatedSteps(controller)
    states, inputs = [numbers("simulate: initial_state", initial_state)], []
    values, without_plan, widened = [], list[Infeasible | Unsolved](), 0
    initial_guess: Array | None = None
    for k in range(first_step, first_step + steps):
        seen = states[-1] if noise is None else states[-1] + _drawn("noise", noise, k, states[-1])
        result = repeated.step(k, seen, table, initial_guess)
        initial_guess = shifted_inputs(result, table) if isinstance(result, Plan) else None
        applied: Array | None
        if isinstance(result, Plan):
            applied = result.input
            values.append((result.cost, result.stage_cost, result.slack))
            widened += result.status is Status.WIDENED
        else:
            without_plan.append(result)
            applied = on_infeasible(result)
            if applied is None:
                break
            values.append((np.nan, np.nan, np.nan))
        inputs.append(applied)
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            successor = system.successor(states[-1], applied)
            if disturbances is not None:
                successor = successor + _drawn("disturbances", disturbances, k, successor)
            states.append(successor)
        if not np.all(np.isfinite(states[-1])):
            without_plan.append(Unsolved(k, "the system is not defined under the input applied", applied))
            del states[-1], inputs[-1], values[-1]
            break
    count = len(inputs)
    costs, stage_costs, slacks = np.array(values, dtype=float).reshape(count, 3).T
    tracked = table.window(first_step, count)
    return ClosedLoop(
        first_step=first_step,
        states=np.array(states),
        inputs=np.array(inputs).reshape(count, len(system.inputs)),
        reference_states=nearest_turns(controller.plant, tracked.states, np.array(states)),
        reference_inputs=tracked.inputs,
        costs=costs,
        stage_costs=stage_costs,
        slacks=slacks,
        without_plan=tuple(without_plan),
        widened=widened,
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
