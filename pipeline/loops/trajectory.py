"""Closed loops over time: where they begin, their numbers, and the form in which they are logged and drawn."""

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

import numpy as np

from trackably.arrays import Array
from trackably.control.references import TrackedReference
from trackably.control.simulation import ClosedLoop
from trackably.control.stepping import Plan
from trackably.systems.constrained import ConstrainedSystem

if TYPE_CHECKING:
    from trackably.control.controller import Controller


ON, ABOVE, BELOW = "on", "above", "below"
_SMALLEST = 1e-3
"""Initial states closer to the reference than this part of the widths are not tried."""


def initial_states(controller: "Controller", reference: TrackedReference, step: int = 0) -> dict[str, Array]:
    """Return states (n,) at a step by name: `on` the reference, `above` it and `below` it.

    The latter two differ from the reference by ± half the widths of the state set, halved until the state lies in the
    set and the controller has a plan there. They are left out where even a thousandth of the widths is too much.
    """
    on_reference = reference.window(step, 1).states[0]
    widths = 1 / np.sqrt(np.diag(controller.Q))
    found = {ON: on_reference}
    for name, sign in ((ABOVE, 1.0), (BELOW, -1.0)):
        part = 0.5
        while part > _SMALLEST and not _is_feasible(controller, reference, step, on_reference + sign * part * widths):
            part /= 2
        if part > _SMALLEST:
            found[name] = np.asarray(on_reference + sign * part * widths)
    return found


def _is_feasible(controller: "Controller", reference: TrackedReference, step: int, state: Array) -> bool:
    inside = bool(controller.plant.state_set.margin(state) >= 0)
    return inside and isinstance(controller.step(step, state, reference), Plan)


def loop_metrics(loop: ClosedLoop, plant: ConstrainedSystem) -> dict[str, float | int | str | None]:
    """Return the numbers of a closed loop by name.

    Errors are x − x_r for each state. Margins are the smallest ones of the applied inputs, and of all states but the
    first. `largest_rise` is the largest V(k + 1) − (V(k) − ℓ(k)), which is at most zero on a trackable reference.
    """
    increases = loop.cost_increases[np.isfinite(loop.cost_increases)]
    errors = loop.errors
    found: dict[str, float | int | str | None] = {
        "steps": len(loop.inputs),
        "infeasible_steps": len(loop.infeasible),
        "first_infeasible_step": loop.first_infeasible_step,
        "unsolved_steps": len(loop.unsolved),
        "why": loop.without_plan[0].explanation if loop.without_plan else None,
        "first_cost": float(loop.costs[0]) if len(loop.costs) and np.isfinite(loop.costs[0]) else None,
        "largest_rise": float(np.max(increases)) if increases.size else None,
        "worst_state_margin": _smallest(plant.state_set.margin(loop.states[1:])),
        "worst_input_margin": _smallest(plant.input_set.margin(loop.inputs)),
    }
    for i, name in enumerate(plant.system.states):
        found[f"rms_error_{name}"] = float(np.sqrt(np.mean(errors[:, i] ** 2)))
        found[f"last_error_{name}"] = float(abs(errors[-1, i]))
    return found


def first_untrackable_step(reference: TrackedReference, plant: ConstrainedSystem, steps: range) -> int | None:
    """Return the first of the `steps` at which the state or the input of a reference is outside its set; None where
    there is no such step."""
    window = reference.window(steps.start, len(steps))
    outside = (plant.state_set.margin(window.states[:-1]) < 0) | (plant.input_set.margin(window.inputs) < 0)
    return steps[int(np.argmax(outside))] if np.any(outside) else None


def _smallest(margins: Array) -> float | None:
    return float(np.min(margins)) if margins.size and np.all(np.isfinite(margins)) else None


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
