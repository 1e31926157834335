"""Closed loops over time, in the form in which they are logged and drawn."""

from dataclasses import dataclass, fields

import numpy as np

from trackably.arrays import Array
from trackably.control.simulation import ClosedLoop


@dataclass(frozen=True, eq=False)
class LoopTrajectory:
    """States (K + 1, n) and inputs (K + 1, m) at `steps` (K + 1,), those of the reference, and the cost of each step.

    Inputs and costs are NaN at the last step, where nothing is applied; costs are NaN at infeasible steps too.
    """

    steps: Array
    states: Array
    inputs: Array
    reference_states: Array
    reference_inputs: Array
    costs: Array
    stage_costs: Array
    slacks: Array

    @classmethod
    def of(cls, loop: ClosedLoop) -> "LoopTrajectory":
        """Return all steps of a closed loop."""
        return cls(
            steps=loop.first_step + np.arange(len(loop.states), dtype=float),
            states=loop.states,
            inputs=_with_last(loop.inputs),
            reference_states=loop.reference_states,
            reference_inputs=_with_last(loop.reference_inputs),
            costs=_with_last(loop.costs),
            stage_costs=_with_last(loop.stage_costs),
            slacks=_with_last(loop.slacks),
        )

    def until(self, step: int) -> "LoopTrajectory":
        """Return the part up to and including a step."""
        kept = self.steps <= step
        return LoopTrajectory(*(getattr(self, field.name)[kept] for field in fields(self)))

    @property
    def infeasible(self) -> Array:
        """The steps at which an input was applied without a plan."""
        return self.steps[np.isnan(self.costs) & np.isfinite(self.inputs[:, 0])]


def _with_last(values: Array) -> Array:
    """Append NaN for the last step."""
    return np.concatenate([values, np.full((1, *values.shape[1:]), np.nan)])


@dataclass(frozen=True, eq=False)
class Runs:
    """Runs of the tube controller at `steps` (K,): coordinates are the states, then the inputs.

    `lowest` and `highest` (K, n + m) are taken over all runs; some `single` runs (R, K, n + m) are kept.
    """

    steps: Array
    lowest: Array
    highest: Array
    single: Array
