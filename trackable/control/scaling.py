"""Weights in the scales of a plant's sets, so that nobody has to choose them."""

import numpy as np

from trackable.arrays import Array
from trackable.control.controller import Controller
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.sets.polytope import Polytope


def scaled_controller(plant: ConstrainedSystem, horizon: int, input_weight: float = 1.0) -> Controller:
    """Return a controller whose cost is the sum of squared errors, each divided by the width of its bounds.

    Inputs are weighted with `input_weight` in addition. Errors in directions without bounds count in their own unit.
    Raises as `Controller`.
    """
    return Controller(plant, horizon, _weight(plant.state_set), input_weight * _weight(plant.input_set))


def _weight(polytope: Polytope) -> Array:
    """Return Σ (row / width)² as a matrix (n, n), plus the identity in directions that no row bounds."""
    rows = polytope.rows / (polytope.upper - polytope.lower)[:, None]
    free = np.eye(polytope.dimension) - np.linalg.pinv(rows) @ rows if len(rows) else np.eye(polytope.dimension)
    weight = rows.T @ rows + np.where(np.abs(free) > 1e-9, free, 0.0)
    return np.asarray((weight + weight.T) / 2)
