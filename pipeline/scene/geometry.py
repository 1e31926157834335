"""The plane that a scene shows, and the part of it in which the state has to stay."""

import numpy as np

from trackably.arrays import Array
from trackably.systems.constrained import ConstrainedSystem

Plane = tuple[str, str]


def plane_of(plant: ConstrainedSystem, wanted: Plane | None) -> Plane | None:
    """Return the two states that a scene shows: those wanted, else x and y, else the two that there are."""
    states = plant.system.states
    if wanted is not None:
        return wanted
    if {"x", "y"} <= {*states}:
        return "x", "y"
    return (states[0], states[1]) if len(states) == 2 else None


def allowed_region(plant: ConstrainedSystem, plane: Plane, within: Array) -> Array:
    """Return the corners (n, 2) of the states in the plane that keep all bounds on these two states alone.

    `within` are the lower and the upper corner of what is looked at at least: where a state is free, the region ends at
    some distance from them.
    """
    columns = [plant.system.states.index(name) for name in plane]
    lower, upper = within
    far = 0.5 * (upper - lower)
    (left, bottom), (right, top) = lower - far, upper + far
    rows, sides = plant.state_set.inequalities
    corners = np.array([[left, bottom], [right, bottom], [right, top], [left, top]])
    for row, side in zip(rows, sides, strict=True):
        if np.any(row[columns]) and not np.delete(row, columns).any():
            corners = _cut(corners, row[columns], side)
    return corners


def _cut(corners: Array, row: Array, side: float) -> Array:
    """Return the part of a convex polygon in which row · p ≤ side."""
    kept = []
    for p, q in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        over_p, over_q = row @ p - side, row @ q - side
        if over_p <= 0:
            kept.append(p)
        if (over_p < 0 < over_q) or (over_q < 0 < over_p):
            kept.append(p + (q - p) * over_p / (over_p - over_q))
    return np.array(kept).reshape(-1, 2)
