"""A controller whose weights are in the scales of a plant's sets, so that one number says how dear inputs are."""

from trackably.control.controller import Controller
from trackably.control.step.scales import weight_in_widths
from trackably.systems.constrained import ConstrainedSystem


def scaled_controller(plant: ConstrainedSystem, horizon: int, input_weight: float = 1.0) -> Controller:
    """Return a controller whose cost is the sum of squared errors, each divided by the width of its bounds.

    Inputs are weighted with `input_weight` in addition. Errors in directions without bounds count in their own unit.
    Raises as `Controller`.
    """
    return Controller(
        plant, horizon, weight_in_widths(plant.state_set), input_weight * weight_in_widths(plant.input_set)
    )
