"""Weights and initial states in the scales of a plant's sets, so that nobody has to choose them."""

import numpy as np

from trackable.arrays import Array
from trackable.control.controller import Controller
from trackable.control.followed import Followed
from trackable.control.step.answer import Step
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.sets.polytope import Polytope

ON, ABOVE, BELOW = "on", "above", "below"
_SMALLEST = 1e-3


def scaled(plant: ConstrainedSystem, horizon: int, input_weight: float = 1.0) -> Controller:
    """A controller whose cost counts every bounded quantity's error as a part of its width, squared.

    Inputs count `input_weight` times as much; directions without a bound, in their own unit. Raises as `Controller`.
    """
    return Controller(plant, horizon, _weight(plant.state_set), input_weight * _weight(plant.input_set))


def starts(controller: Controller, reference: Followed) -> dict[str, Array]:
    """States (n,) at step 0 by name: on the reference, and off it as far as the controller finds a plan, at most.

    `above` and `below` are off it by ± half the widths of the state set, halved until they lie in it and have a plan;
    left out where even a thousandth of the widths does not.
    """
    here = reference.window(0, 1).states[0]
    widths = 1 / np.sqrt(np.diag(controller.Q))
    found = {ON: here}
    for name, sign in ((ABOVE, 1.0), (BELOW, -1.0)):
        part = 0.5
        while part > _SMALLEST and not _can_start(controller, reference, here + sign * part * widths):
            part /= 2
        if part > _SMALLEST:
            found[name] = np.asarray(here + sign * part * widths)
    return found


def _can_start(controller: Controller, reference: Followed, state: Array) -> bool:
    inside = bool(controller.plant.state_set.margin(state) >= 0)
    return inside and isinstance(controller.step(0, state, reference), Step)


def _weight(bounded: Polytope) -> Array:
    """Σ (row / width)² as a matrix (n, n), and the identity where no row reaches."""
    rows = bounded.rows / (bounded.upper - bounded.lower)[:, None]
    free = np.eye(bounded.dimension) - np.linalg.pinv(rows) @ rows if len(rows) else np.eye(bounded.dimension)
    weight = rows.T @ rows + np.where(np.abs(free) > 1e-9, free, 0.0)
    return np.asarray((weight + weight.T) / 2)
