"""Bounds of a plant in a controller: scales, weights, and points pulled into a set."""

from typing import NamedTuple

import numpy as np

from trackably.arrays import Array
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.polytopes import Polytope, extents


class Scales(NamedTuple):
    """One unit for each state (n,) and each input (m,), and one for the cost."""

    states: Array
    inputs: Array
    cost: float

    @classmethod
    def of(cls, plant: ConstrainedSystem, Q: Array, R: Array) -> "Scales":
        """Return the scales of a plant and a cost.

        The scale of a coordinate is how far it may move in its set. The scale of the cost is the largest cost of a
        single coordinate that is off by its scale, 1 if nothing is bounded. The scale of an unbounded coordinate is the
        change that costs as much, 1 if the coordinate has no cost.
        """
        widths = np.concatenate([extents(plant.state_set), extents(plant.input_set)])
        weights, bounded = np.concatenate([np.diag(Q), np.diag(R)]), np.isfinite(widths)
        cost = np.max(weights[bounded] * widths[bounded] ** 2, initial=0.0) or 1.0
        as_costly = np.sqrt(np.divide(cost, weights, out=np.ones_like(weights), where=weights > 0))
        states, inputs = np.split(np.where(bounded, widths, as_costly), [len(Q)])
        return cls(states, inputs, float(cost))


def weight_in_widths(bounded: Polytope) -> Array:
    """Return W (n, n), for which the cost eᵀ W e sums the squares of errors relative to the widths of the set's rows.

    Errors in directions without bounds count in the coordinates' own units.
    """
    rows = bounded.rows / bounded.widths[:, None]
    free = np.eye(bounded.dimension) - np.linalg.pinv(rows) @ rows
    weight = rows.T @ rows + np.where(np.abs(free) > 1e-9, free, 0.0)
    return (weight + weight.T) / 2


_SHRINK = 1 - 2.0**-50
"""Factor that keeps the result of `pull_inside` in the set despite rounding."""


def pull_inside(bounded: Polytope, u: Array) -> Array:
    """Return `u` (m,) if it is in the set, else the last point of the set on the line from its centre to u.

    A solver's u is outside by its tolerance at most. For a box the result then equals clipping, up to that tolerance.
    """
    if bounded.margin(u) >= 0:
        return u
    rows, bounds = bounded.inequalities
    outward, slack = rows @ (u - bounded.centre), bounds - rows @ bounded.centre
    crossed = outward > slack
    part = np.min(slack[crossed] / outward[crossed], initial=1.0)  # 1 if `crossed` is empty, due to rounding
    return bounded.centre + _SHRINK * part * (u - bounded.centre)
