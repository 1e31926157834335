"""Simulate the closed loop of a controller and its system."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from reprlib import repr as short

import numpy as np

from trackably.arguments import array, instance, numbers, whole
from trackably.arrays import Array, ArrayLike
from trackably.control.controller import Controller
from trackably.control.references import TabulatedReference, TrackedReference, check_reference
from trackably.control.stepping import (
    Disturbances,
    Infeasible,
    Plan,
    StepResult,
    Successor,
    Unsolved,
)
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.disturbances import DisturbanceSet, ModelError
from trackably.systems.tightening import closed_loop, error_rows


@dataclass(frozen=True, eq=False)
class ClosedLoop:
    """K steps of the closed loop, from step `first_step` on.

    `states` (K + 1, n) and `inputs` (K, m) are those of the system, `reference_states` (K + 1, n) and
    `reference_inputs` (K, m) those of the reference. `results` are the controller's, step by step; if the simulation
    ended early, the last one says why.
    """

    first_step: int
    states: Array
    inputs: Array
    reference_states: Array
    reference_inputs: Array
    results: tuple[StepResult, ...]

    def __repr__(self) -> str:
        last = self.first_step + len(self.inputs)
        largest = np.max(np.abs(self.errors), axis=0).tolist()
        return (
            f"ClosedLoop(steps {self.first_step} to {last}, largest errors {', '.join(f'{e:.3g}' for e in largest)}, "
            f"{len(self.infeasible)} infeasible, {len(self.unsolved)} unsolved)"
        )

    @property
    def without_plan(self) -> tuple[Infeasible | Unsolved, ...]:
        """The results without a plan."""
        return tuple(result for result in self.results if not isinstance(result, Plan))

    @property
    def costs(self) -> Array:
        """The optimal costs V(k), shape (K,); NaN at the steps without a plan."""
        return self._of_plans("cost")

    @property
    def stage_costs(self) -> Array:
        """The first terms ℓ(k) of the costs, shape (K,); NaN at the steps without a plan."""
        return self._of_plans("stage_cost")

    @property
    def slacks(self) -> Array:
        """The smallest slacks of the plans, shape (K,); NaN at the steps without a plan."""
        return self._of_plans("slack")

    def _of_plans(self, name: str) -> Array:
        return np.array([getattr(result, name, np.nan) for result in self.results[: len(self.inputs)]], dtype=float)

    @property
    def infeasible(self) -> tuple[Infeasible, ...]:
        """The steps at which there is no plan."""
        return tuple(result for result in self.without_plan if isinstance(result, Infeasible))

    @property
    def unsolved(self) -> tuple[Unsolved, ...]:
        """The steps at which it is not known whether there is a plan."""
        return tuple(result for result in self.without_plan if isinstance(result, Unsolved))

    @property
    def steps(self) -> Array:
        """The steps k of inputs and costs, shape (K,)."""
        return self.first_step + np.arange(len(self.inputs), dtype=float)

    @property
    def errors(self) -> Array:
        """The tracking errors x(k) − x_r(k), shape (K + 1, n)."""
        return self.states - self.reference_states

    @property
    def cost_increases(self) -> Array:
        """V(k+1) − V(k) + ℓ(k), shape (K − 1,): at most zero at every step at which the reference is trackable.

        The plan of step k, shifted by a step and continued with the reference's own input, is admissible at step k + 1
        and costs V(k) − ℓ(k) there. The optimum costs no more. NaN if either step has no plan.
        """
        return np.diff(self.costs) + self.stage_costs[:-1]


InfeasibilityPolicy = Callable[[Infeasible | Unsolved], Array | None]
"""Returns the input (m,) to apply if the controller finds no plan; None ends the simulation."""


def stop(_: Infeasible | Unsolved) -> None:
    """End the simulation when the controller finds no plan."""


def apply_fallback(result: Infeasible | Unsolved) -> Array:
    """Apply the `fallback`: the first input of a plan that ends close to the reference, or another admissible input."""
    return result.fallback


def apply_fallback_for(steps: int) -> InfeasibilityPolicy:
    """Return a policy for one simulation: `apply_fallback` for a number of steps in all, then `stop`."""
    remaining = iter(range(steps))
    return lambda result: None if next(remaining, None) is None else apply_fallback(result)


def simulate(
    controller: Controller,
    reference: TrackedReference,
    initial_state: ArrayLike,
    steps: int,
    *,
    first_step: int = 0,
    on_infeasible: InfeasibilityPolicy = stop,
    disturbances: Disturbances | None = None,
    measurement_noise: Disturbances | None = None,
    successor: Successor | None = None,
) -> ClosedLoop:
    """Simulate the closed loop from `initial_state` (n,) at `first_step`, for `steps` steps.

    The simulated plant is `successor`, a function of k, x and u; left out, the controller's own model,
    `controller.plant`. `disturbances` are added to each of its states; by default there are none. `measurement_noise`
    is added to the state that the controller measures; states of the loop are the true ones. If the controller finds no
    plan, `on_infeasible` chooses the input, or ends the simulation: `stop`, `apply_fallback` and
    `apply_fallback_for(steps)` are such functions. The simulation also ends, as unsolved, if the system's formulas are
    undefined after an input.

    Raises as `Controller.step` and as `reference.window`. TypeError or ValueError: disturbances, noise or `successor`
    are no function, or do not return n numbers.
    """
    if not callable(getattr(controller, "step", None)):
        raise TypeError(f"simulate: controller: expected a Controller(plant, horizon, Q, R), got {controller!r}")
    check_reference("simulate", reference, controller.plant)
    first_step, steps = whole("simulate: first_step", first_step), whole("simulate: steps", steps, least=0)
    last = first_step + steps + controller.horizon + 1
    try:
        table = TabulatedReference.of(reference, first_step, last)
    except ValueError as error:
        raise ValueError(
            f"simulate: steps: {steps} steps from step {first_step} on, with plans that look {controller.horizon + 1} "
            f"steps ahead, need the reference up to step {last}: {error}"
        ) from error
    plant, guess = controller.plant, None
    states, inputs, results = [numbers("simulate: initial_state", initial_state)], list[Array](), list[StepResult]()
    for k in range(first_step, first_step + steps):
        x = states[-1]
        seen = x if measurement_noise is None else x + _vector("measurement_noise", measurement_noise, k, x)
        result = controller.step(k, seen, table, guess)
        results.append(result)
        if isinstance(result, Plan):
            guess, applied = shifted_inputs(result, table), result.input
        else:
            guess, chosen = None, on_infeasible(result)
            if chosen is None:
                break
            applied = chosen
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            x = (
                plant.system.successor(x, applied)
                if successor is None
                else _vector("successor", successor, k, x, applied)
            )
            if disturbances is not None:
                x = x + _vector("disturbances", disturbances, k, x)
        if not np.all(np.isfinite(x)):
            results.append(Unsolved(k, "the system is not defined under the input applied", applied))
            break
        inputs.append(applied)
        states.append(x)
    tracked = table.window(first_step, len(inputs))
    return ClosedLoop(
        first_step=first_step,
        states=np.array(states),
        inputs=np.array(inputs).reshape(len(inputs), len(plant.system.inputs)),
        # Step by step, as a `successor` may return angles between −π and π.
        reference_states=np.vstack([plant.unwrap(row[None], x) for row, x in zip(tracked.states, states, strict=True)]),
        reference_inputs=tracked.inputs,
        results=tuple(results),
    )


def _vector(what: str, of: Callable[..., Array], k: int, state: Array, *applied: Array) -> Array:
    """Return the vector (n,) that a function gives at a step. Other shapes are refused, as NumPy would broadcast a
    number to all states.
    """
    of_what = "the step k, the state and the input" if applied else "the step k and the state"
    if not callable(of):
        raise TypeError(f"simulate: {what}: expected a function of {of_what}, got {short(of)}")
    found = numbers(f"simulate: {what} at step {k}", of(k, state, *applied))
    if found.shape != state.shape:
        raise ValueError(f"simulate: {what}: expected {state.size} numbers at step {k}, got shape {found.shape}")
    return found


def shifted_inputs(plan: Plan, reference: TrackedReference) -> Array:
    """Return the inputs (N, m) of a plan from its second on, continued with the reference's own input.

    They are admissible at step k + 1 if the reference is trackable, and then a good initial guess.
    """
    end = plan.k + len(plan.inputs)
    return np.vstack([plan.inputs[1:], reference.window(end, 1).inputs])


# Search for a plant of a convex hull that violates a bound under the feedback.
#
# If such a plant is found, no proof is possible.

_AHEAD = (0, 1, 2, 5, 10, 20, 50)
"""Numbers of steps ahead: a vertex is chosen to push the state to a bound after this many further nominal steps."""


@dataclass(frozen=True, eq=False)
class WorstPlant:
    """A plant that changes from vertex to vertex of a model error's hull, and comes closest to violating a bound.

    `vertices` has the index of the vertex at each step from `first_step` on. The plant comes closest to the bound of
    the quantity `name` at `step`. The bound is violated by `violation`, in its unit; negative if that much slack is
    left. `states` (steps + 1, n) are those of the plant, which starts on the reference.
    """

    name: str
    step: int
    violation: float
    first_step: int
    vertices: tuple[int, ...]
    states: Array

    @property
    def breaks(self) -> bool:
        """Whether the bound is violated."""
        return self.violation > 0

    def __str__(self) -> str:
        size = f"{abs(self.violation):.4g}"
        if self.breaks:
            return f"at step {self.step} the plant breaks the bound of {self.name} by {size}"
        return f"the plant is nearest to a bound at step {self.step}, {size} away from that of {self.name}"


def worst_plant(
    reference: TrackedReference,
    plant: ConstrainedSystem,
    model_error: ModelError,
    feedback: ArrayLike,
    steps: int,
    *,
    first_step: int = 0,
    disturbance: DisturbanceSet | None = None,
) -> WorstPlant:
    """Return the worst plant that is found under u = u_r + K (x − x_r), for the sets of `plant`.

    Three kinds of policies are tried: for each bound and some numbers of steps ahead, the vertices and disturbances
    that push the state furthest towards the bound; each vertex alone; and switching from one vertex to the next. This
    is a search, and there may be worse plants. `feedback` is K (m, n). Raises as `reference.window`, and TypeError and
    ValueError as `learn_reference` does for these arguments.
    """
    instance("worst_plant: plant", plant, ConstrainedSystem, "a ConstrainedSystem(system, state_set, input_set)")
    instance("worst_plant: model_error", model_error, ModelError, "a ModelError")
    if not (constraints := plant.given_constraints):
        raise ValueError("worst_plant: expected a plant with bounds of states or inputs, got one without")
    n, m = plant.linear.B.shape
    K, steps = array("worst_plant: feedback", feedback, m, n), whole("worst_plant: steps", steps, least=1)
    window = reference.window(first_step, steps)
    A, B, c = (np.array([getattr(vertex, name) for vertex in model_error.vertices]) for name in "ABc")
    rows, A_K = error_rows(plant, K), closed_loop(plant.linear, K)
    directions = np.vstack([sign * rows @ np.linalg.matrix_power(A_K, ahead) for ahead in _AHEAD for sign in (1, -1)])
    greedy, q = len(directions), len(A)
    x = np.tile(window.states[0], (greedy + q + 1, 1))
    states, chosen, inputs = [x], [], []
    pushes = np.array([np.zeros(n) if disturbance is None else disturbance.farthest(row) for row in directions])
    for k in range(steps):
        u = window.inputs[k] + (x - window.states[k]) @ K.T
        after = np.einsum("qij,pj->pqi", A, x) + np.einsum("qij,pj->pqi", B, u) + c  # next states, by policy and vertex
        pick = np.append(np.argmax(np.einsum("pqi,pi->pq", after[:greedy], directions), axis=1), [*range(q), k % q])
        x = after[np.arange(len(x)), pick] + np.vstack([pushes, np.tile(pushes[k % greedy], (q + 1, 1))])
        states.append(x)
        inputs.append(u)
        chosen.append(pick)
    values = {"state": np.array(states), "input": np.array(inputs)}
    excesses = [-of.bounds.margin(values[of.side] @ np.array(of.row, dtype=float)) for of in constraints]
    over, worst = max(
        zip(excesses, constraints, strict=True), key=lambda each: float(np.max(each[0])) / each[1].bounds.width
    )
    k, p = divmod(int(np.argmax(over)), over.shape[1])
    vertices, path = tuple(int(pick[p]) for pick in chosen), values["state"][:, p]
    return WorstPlant(worst.name, first_step + k, float(over[k, p]), first_step, vertices, path)
