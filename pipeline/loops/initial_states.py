"""Initial states on a reference and beside it, in the scales of a plant's sets."""

from typing import TYPE_CHECKING

import numpy as np

from trackably.arrays import Array
from trackably.control.references import TrackedReference
from trackably.control.stepping import Plan

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
