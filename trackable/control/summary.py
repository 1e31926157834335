"""What remains of a loop: its course over time, and the numbers that say whether it went well."""

from dataclasses import dataclass, fields

import numpy as np

from trackable.arrays import Array
from trackable.control.followed import Followed
from trackable.control.loop import Loop
from trackable.systems.constrained import ConstrainedSystem


@dataclass(frozen=True, eq=False)
class Course:
    """States (K + 1, n) and inputs (K + 1, m) at `steps` (K + 1,), beside the reference's, and each step's cost.

    Nothing is applied at the last step, and no plan exists at infeasible ones: NaN.
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
    def of(cls, loop: Loop) -> "Course":
        """All that a loop went through."""
        return cls(
            steps=loop.first + np.arange(len(loop.states), dtype=float),
            states=loop.states,
            inputs=_continued(loop.inputs),
            reference_states=loop.reference_states,
            reference_inputs=_continued(loop.reference_inputs),
            costs=_continued(loop.costs),
            stage_costs=_continued(loop.stage_costs),
            slacks=_continued(loop.slacks),
        )

    def until(self, step: int) -> "Course":
        """Its part up to and including a step."""
        kept = self.steps <= step
        return Course(*(getattr(self, field.name)[kept] for field in fields(self)))

    @property
    def infeasible(self) -> Array:
        """The steps at which something was applied without a plan."""
        return self.steps[np.isnan(self.costs) & np.isfinite(self.inputs[:, 0])]


def summary(loop: Loop, plant: ConstrainedSystem) -> dict[str, float | int | str | None]:
    """Numbers of a loop.

    Errors are x − x_r by state, and margins those of the applied inputs and of all states after the first one. The
    largest rise is that of V(k + 1) − (V(k) − ℓ(k)), which a trackable reference keeps from being positive.
    """
    rises = loop.rises[np.isfinite(loop.rises)]
    errors = loop.errors
    found: dict[str, float | int | str | None] = {
        "steps": len(loop.inputs),
        "infeasible_steps": len(loop.infeasible),
        "first_infeasible_step": loop.first_infeasible,
        "why": loop.infeasible[0].explanation if loop.infeasible else None,
        "first_cost": float(loop.costs[0]) if len(loop.costs) and np.isfinite(loop.costs[0]) else None,
        "largest_rise": float(np.max(rises)) if rises.size else None,
        "worst_state_margin": _least(plant.state_set.margin(loop.states[1:])),
        "worst_input_margin": _least(plant.input_set.margin(loop.inputs)),
    }
    for i, name in enumerate(plant.system.states):
        found[f"rms_error_{name}"] = float(np.sqrt(np.mean(errors[:, i] ** 2)))
        found[f"last_error_{name}"] = float(abs(errors[-1, i]))
    return found


def first_untrackable(reference: Followed, plant: ConstrainedSystem, steps: int) -> int | None:
    """The first of the steps 0 … `steps` − 1 at which the reference's own state or input is outside its set."""
    window = reference.window(0, steps)
    outside = (plant.state_set.margin(window.states[:-1]) < 0) | (plant.input_set.margin(window.inputs) < 0)
    return int(np.argmax(outside)) if np.any(outside) else None


def _least(margins: Array) -> float | None:
    return float(np.min(margins)) if margins.size and np.all(np.isfinite(margins)) else None


def _continued(values: Array) -> Array:
    return np.concatenate([values, np.full((1, *values.shape[1:]), np.nan)])
