"""Whole turns: a heading of 350° equals one of −10°, and a controller uses the nearer one."""

import numpy as np

from trackably.arrays import Array
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.reference import Window


def unwrap_near(plant: ConstrainedSystem, window: Window, state: Array) -> Window:
    """Return a window of a reference with whole turns added to its angles. Without angles it is the same window.

    The angles begin near those of `state` (n,) and do not jump.
    """
    angles = angles_of(plant)
    if not angles:
        return window
    states = window.states.copy()
    continuous = np.unwrap(states[:, angles], axis=0)
    states[:, angles] = continuous + _turns(state[angles] - continuous[0])
    return Window(states, window.inputs)


def nearest_turns(plant: ConstrainedSystem, states: Array, near: Array) -> Array:
    """Return `states` (…, n) with whole turns added to each angle, so that it is as near as possible to that in `near`.

    `near` has the shape (…, n).
    """
    angles = angles_of(plant)
    turned = states.copy()
    turned[..., angles] += _turns(near[..., angles] - turned[..., angles])
    return turned


def angles_of(plant: ConstrainedSystem) -> list[int]:
    """Return the indices of the states that are angles, which are equal up to whole turns."""
    form = plant.flat_form
    return [i for i, name in enumerate(plant.system.states) if form is not None and name in form.angles]


def _turns(difference: Array) -> Array:
    """Return the multiple of 2π [rad] that is nearest to a difference."""
    return np.asarray(2 * np.pi * np.round(difference / (2 * np.pi)))
