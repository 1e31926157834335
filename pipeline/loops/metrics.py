"""Numbers that say how well a closed loop tracks its reference."""

import numpy as np

from trackably.arrays import Array
from trackably.control.references import TrackedReference
from trackably.control.simulation import ClosedLoop
from trackably.systems.constrained import ConstrainedSystem


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
