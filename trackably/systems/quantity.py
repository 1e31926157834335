"""A bounded quantity of a reference: a state, an input, or a weighted sum of either."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from trackably.arrays import Array
from trackably.systems.flat.functional import Functional, Signals
from trackably.systems.flat.trajectory import Trajectory
from trackably.systems.sets.interval import Interval


@dataclass(frozen=True)
class Quantity:
    """A `trajectory` that must stay in `bounds`, and its name."""

    name: str
    trajectory: Trajectory
    bounds: Interval

    @property
    def functional(self) -> Functional | None:
        """The functional, if the trajectory is one itself; otherwise None."""
        return self.trajectory.functional

    def __call__(self, signals: Signals, t: Array) -> Array:
        """Return the value at t [s]: the shape of t; NaN or infinite where it is not defined."""
        return self.trajectory(signals, t)

    def margin(self, signals: Signals, t: Array) -> Array:
        """Return the distance to the nearer bound at t [s]: negative outside, −∞ where the value is not defined."""
        margin = self.bounds.margin(self(signals, t))
        return np.asarray(np.where(np.isnan(margin), -np.inf, margin))

    def at_rest(self, levels: Sequence[float]) -> float:
        """Return the value while every signal c is constant at `levels[c]`."""
        return self.trajectory.at_rest(levels)
