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
        single coordinate that is off by its scale. The scale of an unbounded coordinate follows from the dynamics
        (`_spread`).
        """
        widths = np.concatenate([extents(plant.state_set), extents(plant.input_set)])
        states, inputs = np.split(_spread(widths, _gains(plant), 1 / np.sqrt(np.diag(R))), [len(Q)])
        costs = np.concatenate([np.diag(Q) * states**2, np.diag(R) * inputs**2])
        return cls(states, inputs, float(np.max(costs)))


def weight_in_widths(bounded: Polytope) -> Array:
    """Return the weight (n, n) of a cost of errors relative to the widths of a set; errors in directions
    without bounds count in the coordinates' own units.
    """
    rows = bounded.rows / bounded.widths[:, None]
    free = np.eye(bounded.dimension) - np.linalg.pinv(rows) @ rows if len(rows) else np.eye(bounded.dimension)
    weight = rows.T @ rows + np.where(np.abs(free) > 1e-9, free, 0.0)
    return (weight + weight.T) / 2


def _gains(plant: ConstrainedSystem) -> Array:
    """Return |[A, B]| entry by entry (n, n + m), linearised in the middle of the sets; undefined entries count as 0."""
    x, u = plant.state_set.at(0.0).centre, plant.input_set.at(0.0).centre
    with np.errstate(all="ignore"):
        A, B = plant.system.slopes(x, u)
    gains = np.abs(np.hstack([A, B]))
    return np.where(np.isfinite(gains), gains, 0.0)


def _spread(widths: Array, gains: Array, otherwise: Array) -> Array:
    """Return `widths` (n + m,) with each infinite entry replaced by a scale that follows from known scales.

    With the `gains` g (n, n + m), a state gets as scale its largest change in one step that a coordinate j with a known
    scale s_j causes, max_j g_ij s_j. Inputs, and states that depend on no such coordinate, get the change that moves a
    state i with a known scale by this scale, min_i s_i / g_ij. If no scale follows in this way, inputs get `otherwise`
    (m,). All remaining coordinates get 1.
    """
    scales, n = widths.copy(), len(gains)
    for _ in scales:
        unknown = np.isinf(scales)
        forward = np.max(gains * np.where(unknown, 0.0, scales), axis=1)
        with np.errstate(divide="ignore"):
            backward = np.min(scales[:n, None] / gains, axis=0, initial=np.inf)
        found = np.concatenate([np.where(forward > 0, forward, backward[:n]), backward[n:]])
        if not np.any(unknown & np.isfinite(found)):
            found = np.concatenate([np.full(n, np.inf), otherwise])
        scales = np.where(unknown, found, scales)
    return np.where(np.isfinite(scales), scales, 1.0)


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
