"""Scales of states and inputs: divided by them, a problem has the same numbers in whatever units it is given."""

from dataclasses import dataclass

import numpy as np

from trackably.arrays import Array
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.sets.polytope import Polytope
from trackably.systems.sets.scales import extents, squares_in_widths, unit_scales


@dataclass(frozen=True, eq=False)
class Scales:
    """One unit for each state (n,) and each input (m,), and one for the cost."""

    states: Array
    inputs: Array
    cost: float

    @classmethod
    def of(cls, plant: ConstrainedSystem, Q: Array, R: Array) -> "Scales":
        """Return the widths of the sets as scales, and the largest cost of an error of one scale.

        A coordinate without bounds gets the scale that the dynamics give it (`_spread`).
        """
        widths = np.concatenate([extents(plant.state_set), extents(plant.input_set)])
        states, inputs = np.split(_spread(widths, _gains(plant), 1 / np.sqrt(np.diag(R))), [len(Q)])
        costs = np.concatenate([np.diag(Q) * states**2, np.diag(R) * inputs**2])
        return cls(states, inputs, float(np.max(costs)))

    def weights(self, Q: Array, R: Array) -> tuple[Array, Array]:
        """Return Q and R of the scaled errors e / s_x and v / s_u, for a cost in its scale."""
        x, u = self.states, self.inputs
        return Q * x[:, None] * x / self.cost, R * u[:, None] * u / self.cost


def weight_in_widths(bounded: Polytope) -> Array:
    """Return the weight (n, n) of a cost of errors as parts of widths, and in their own unit where no row bounds."""
    rows = bounded.rows / bounded.widths[:, None]
    free = np.eye(bounded.dimension) - np.linalg.pinv(rows) @ rows if len(rows) else np.eye(bounded.dimension)
    weight = squares_in_widths(bounded) + np.where(np.abs(free) > 1e-9, free, 0.0)
    return np.asarray((weight + weight.T) / 2)


def _gains(plant: ConstrainedSystem) -> Array:
    """Return (|A| |B|), shape (n, n + m), in the middle of the sets. Entries that are not defined there count as 0."""
    x, u = middle(plant.state_set), middle(plant.input_set)
    with np.errstate(all="ignore"):
        A, B = plant.system.slopes(x, u)
    gains = np.abs(np.hstack([A, B]))
    return np.where(np.isfinite(gains), gains, 0.0)


def middle(bounded: Polytope) -> Array:
    """Return a point (n,) near the middle of all intervals, zero in directions without bounds."""
    scale, widths = unit_scales(bounded), bounded.widths
    rows = bounded.rows * scale / widths[:, None]
    return np.asarray(scale * (np.linalg.pinv(rows) @ ((bounded.lower / 2 + bounded.upper / 2) / widths)))


def _spread(widths: Array, gains: Array, otherwise: Array) -> Array:
    """Return `widths` (n + m,) with each infinite entry replaced by a scale from coordinates that have one.

    A coordinate without a scale gets that of its changes in a step, max_j g_ij s_j; where it depends on none that has a
    scale, the change of it that moves another by one scale, min_i s_i / g_ij. Inputs get `otherwise` (m,) where
    no coordinate has a scale, and all get 1 where no slope tells more.
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
