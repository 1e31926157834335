"""The result of a simulation: states, inputs and costs of the closed loop at each step."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from trackably.arrays import Array
from trackably.control.step.result import Infeasible, Unsolved


@dataclass(frozen=True, eq=False)
class ClosedLoop:
    """K steps of the closed loop, from step `first_step` on.

    `states` (K + 1, n) and `inputs` (K, m) are those of the system, `reference_states` (K + 1, n) and
    `reference_inputs` (K, m) those of the reference. The optimal `costs` V(k), the `stage_costs` ℓ(k) and the smallest
    `slacks` have shape (K,); they are NaN at the steps that `without_plan` explains, in order. `widened` is the number
    of steps that were feasible only within the controller's tolerance.
    """

    first_step: int
    states: Array
    inputs: Array
    reference_states: Array
    reference_inputs: Array
    costs: Array
    stage_costs: Array
    slacks: Array
    without_plan: tuple[Infeasible | Unsolved, ...]
    widened: int

    def __repr__(self) -> str:
        last = self.first_step + len(self.inputs)
        largest = np.max(np.abs(self.errors), axis=0).tolist()
        return (
            f"ClosedLoop(steps {self.first_step} to {last}, largest errors {', '.join(f'{e:.3g}' for e in largest)}, "
            f"{len(self.infeasible)} infeasible, {len(self.unsolved)} unsolved)"
        )

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
        """x(k) − x_r(k), shape (K + 1, n)."""
        return self.states - self.reference_states

    @property
    def first_infeasible_step(self) -> int | None:
        """The first step that is infeasible; None where none is."""
        return self.infeasible[0].k if self.infeasible else None

    @property
    def cost_increases(self) -> Array:
        """V(k+1) − V(k) + ℓ(k), shape (K − 1,): at most zero wherever the reference is trackable.

        The plan of step k, shifted by a step and continued with the reference's own input, is admissible at step k + 1
        and costs V(k) − ℓ(k) there. The optimum costs no more. NaN where either step has no plan.
        """
        return np.asarray(np.diff(self.costs) + self.stage_costs[:-1])


def concatenate(loops: Sequence[ClosedLoop]) -> ClosedLoop:
    """Join loops that follow each other, each starting at the last state of the one before.

    Where the reference changes between two loops the cost may rise; `reference_states` at that step are those of the
    new reference.
    """

    def values(of: Callable[[ClosedLoop], Array]) -> Array:
        return np.concatenate([of(loop) for loop in loops])

    def states(of: Callable[[ClosedLoop], Array]) -> Array:
        return np.concatenate([*(of(loop)[:-1] for loop in loops), of(loops[-1])[-1:]])

    return ClosedLoop(
        first_step=loops[0].first_step,
        states=states(lambda loop: loop.states),
        inputs=values(lambda loop: loop.inputs),
        reference_states=states(lambda loop: loop.reference_states),
        reference_inputs=values(lambda loop: loop.reference_inputs),
        costs=values(lambda loop: loop.costs),
        stage_costs=values(lambda loop: loop.stage_costs),
        slacks=values(lambda loop: loop.slacks),
        without_plan=tuple(result for loop in loops for result in loop.without_plan),
        widened=sum(loop.widened for loop in loops),
    )
