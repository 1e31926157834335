"""A bounded quantity of a reference: one side of trackability."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from trackable.arrays import Array
from trackable.systems.flat.functional import Functional, Signals
from trackable.systems.flat.trajectory import Trajectory
from trackable.systems.sets.interval import Interval


@dataclass(frozen=True)
class Quantity:
    """A `trajectory` that is wanted in `bounds`: a state, an input, or a weighted sum of them."""

    name: str
    trajectory: Trajectory
    bounds: Interval

    @property
    def functional(self) -> Functional | None:
        """The functional that it is; None where it is a formula of some."""
        return self.trajectory.functional

    def __call__(self, signals: Signals, t: Array) -> Array:
        """The value at t [s]; NaN or infinite where it is not defined."""
        return self.trajectory(signals, t)

    def margin(self, signals: Signals, t: Array) -> Array:
        """Distance to the nearer bound at t [s]: negative where broken, minus infinity where it is not defined."""
        margin = self.bounds.margin(self(signals, t))
        return np.asarray(np.where(np.isnan(margin), -np.inf, margin))

    def at_rest(self, levels: Sequence[float]) -> float:
        """The value while every signal is constant, at these levels."""
        return self.trajectory.at_rest(levels)
