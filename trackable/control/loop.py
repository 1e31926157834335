"""The loop closed: a controller and its system, step after step."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from trackable.arrays import Array
from trackable.control.controller import Controller
from trackable.control.followed import Followed, Tabulated
from trackable.control.step.answer import Infeasible, Status, Step

Policy = Callable[[Infeasible], Array | None]
"""What to apply (m,) where the controller finds no plan; None ends the loop."""


def stop(_: Infeasible) -> None:
    """The loop ends where the controller loses feasibility."""


def least_violation(answer: Infeasible) -> Array:
    """Go on with the plan that comes closest to the terminal constraint."""
    return answer.fallback


def patient(count: int) -> Policy:
    """As `least_violation`, for `count` steps of one loop; then as `stop`."""
    left = iter(range(count))
    return lambda answer: None if next(left, None) is None else least_violation(answer)


@dataclass(frozen=True, eq=False)
class Loop:
    """What happened from step `first` on, in K steps.

    `states` (K + 1, n) and `inputs` (K, m), beside those of the reference, `reference_states` and `reference_inputs`.
    Each step's optimal `costs` V(k), `stage_costs` ℓ(k) and smallest `slacks` (K,) are NaN where it was `infeasible`:
    (step, why) in their order. `widened` counts steps that needed the controller's tolerance.
    """

    first: int
    states: Array
    inputs: Array
    reference_states: Array
    reference_inputs: Array
    costs: Array
    stage_costs: Array
    slacks: Array
    infeasible: tuple[Infeasible, ...]
    widened: int

    @property
    def steps(self) -> Array:
        """The steps k of inputs and costs, shape (K,)."""
        return self.first + np.arange(len(self.inputs), dtype=float)

    @property
    def errors(self) -> Array:
        """x(k) − x_r(k), shape (K + 1, n)."""
        return self.states - self.reference_states

    @property
    def first_infeasible(self) -> int | None:
        return self.infeasible[0].k if self.infeasible else None

    @property
    def rises(self) -> Array:
        """V(k+1) − V(k) + ℓ(k), shape (K − 1,): at most zero wherever the reference is trackable.

        Shifted by a step and continued with the reference's own input, the plan of step k is admissible at step k + 1,
        where it costs V(k) − ℓ(k); the optimum costs no more. NaN beside infeasible steps.
        """
        return np.asarray(np.diff(self.costs) + self.stage_costs[:-1])


def simulate(
    controller: Controller, reference: Followed, state: Array, steps: int, first: int = 0, policy: Policy = stop
) -> Loop:
    """The closed loop from `state` (n,) at step `first`, for `steps` steps or until `policy` ends it.

    The system is the controller's own model, without disturbances.
    """
    table = Tabulated.of(reference, first, first + steps + controller.horizon + 1)
    system = controller.plant.system
    states, inputs = [np.array(state, dtype=float)], []
    values, infeasible, widened = [], [], 0
    guess: Array | None = None
    for k in range(first, first + steps):
        answer = controller.step(k, states[-1], table, guess)
        guess = continued(answer, table) if isinstance(answer, Step) else None
        applied: Array | None
        if isinstance(answer, Step):
            applied = answer.input
            values.append((answer.cost, answer.stage_cost, answer.slack))
            widened += answer.status is Status.WIDENED
        else:
            infeasible.append(answer)
            applied = policy(answer)
            if applied is None:
                break
            values.append((np.nan, np.nan, np.nan))
        inputs.append(applied)
        states.append(system.successor(states[-1], applied))
    count = len(inputs)
    costs, stage_costs, slacks = np.array(values, dtype=float).reshape(count, 3).T
    followed = table.window(first, count)
    return Loop(
        first=first,
        states=np.array(states),
        inputs=np.array(inputs).reshape(count, len(controller.R)),
        reference_states=followed.states,
        reference_inputs=followed.inputs,
        costs=costs,
        stage_costs=stage_costs,
        slacks=slacks,
        infeasible=tuple(infeasible),
        widened=widened,
    )


def continued(step: Step, reference: Followed) -> Array:
    """The inputs (N, m) of a plan from its second on, and then the reference's own: what step k + 1 may begin with."""
    end = step.k + len(step.inputs)
    return np.vstack([step.inputs[1:], reference.window(end, 1).inputs])


def joined(parts: list[Loop]) -> Loop:
    """Loops that follow each other, as one; beside a change of reference the cost may rise.

    At such a step `reference_states` are those that are followed from there on.
    """

    def over(of: Callable[[Loop], Array]) -> Array:
        return np.concatenate([of(part) for part in parts])

    def states(of: Callable[[Loop], Array]) -> Array:
        return np.concatenate([*(of(part)[:-1] for part in parts), of(parts[-1])[-1:]])

    return Loop(
        first=parts[0].first,
        states=states(lambda part: part.states),
        inputs=over(lambda part: part.inputs),
        reference_states=states(lambda part: part.reference_states),
        reference_inputs=over(lambda part: part.reference_inputs),
        costs=over(lambda part: part.costs),
        stage_costs=over(lambda part: part.stage_costs),
        slacks=over(lambda part: part.slacks),
        infeasible=tuple(answer for part in parts for answer in part.infeasible),
        widened=sum(part.widened for part in parts),
    )
