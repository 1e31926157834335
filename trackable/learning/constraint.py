"""Constraints of the learning problem: a quantity that has to stay in its bounds, and where it is asked."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import partial

import numpy as np

from trackable.arrays import Array
from trackable.gp.joint import JointPosterior
from trackable.learning.index_set import IndexSet
from trackable.systems.flat.functional import Functional
from trackable.systems.quantity import Quantity

# Bounds are drawn in by this part of their width, so that rounding in the optimiser cannot leave them.
ROUNDING_BACKOFF = 1e-9


class Bounded(ABC):
    """A quantity that has to stay inside its bounds, drawn in by `backoff` (a part of their width), where it is asked.

    Where that is, one row of an array says: a time, or whatever else a subclass needs to know.
    """

    quantity: Quantity
    backoff: float

    @property
    @abstractmethod
    def none(self) -> Array:
        """No place at all, in the shape of places."""

    @abstractmethod
    def closest(self, posterior: JointPosterior) -> tuple[Array, Array]:
        """Places where the margin is locally smallest, and the relative margins (n,) there.

        Relative: a part of the bounds' width, negative where broken, 1/2 at the centre.
        """

    def overlooked(self, posterior: JointPosterior) -> tuple[Array, Array]:
        """Places where it is broken although `closest` did not look there, and the relative margins."""
        return self.none, np.empty(0)

    @abstractmethod
    def value_and_gradient(self, posterior: JointPosterior, places: Array) -> tuple[Array, Array]:
        """The quantity at n places and its ∂/∂ln θ: shapes (n,) and (p, n). NaN or infinite where it is not defined."""


@dataclass(frozen=True)
class Constraint(Bounded):
    """A quantity at all times of an index set; a place is a time [s]."""

    quantity: Quantity
    index_set: IndexSet
    backoff: float = ROUNDING_BACKOFF

    @property
    def none(self) -> Array:
        return np.empty(0)

    def closest(self, posterior: JointPosterior) -> tuple[Array, Array]:
        margin = partial(self.relative_margin, posterior)
        times = self.index_set.local_minima(margin, [signal.kernel for signal in posterior.signals])
        return times, margin(times)

    def overlooked(self, posterior: JointPosterior) -> tuple[Array, Array]:
        margin, curvature = partial(self.relative_margin, posterior), partial(self._curvature, posterior)
        times = self.index_set.overlooked(margin, [signal.kernel for signal in posterior.signals], curvature)
        return times, margin(times)

    def relative_margin(self, posterior: JointPosterior, t: Array) -> Array:
        """Distance to the nearer bound as a part of the bounds' width: negative where broken, 1/2 at the centre."""
        return self.quantity.margin(posterior.signals, t) / self.quantity.bounds.width

    def _curvature(self, posterior: JointPosterior) -> float:
        """A bound of |d²/dt²| of the relative margin [1/s²]; infinite for formulas, of which none is known."""
        if (functional := self.quantity.functional) is None:
            return np.inf
        moved = (float(np.sum(np.abs(w))) * posterior.signals[c].curvature for c, w in functional.rounded)
        return sum(moved) / self.quantity.bounds.width

    def value_and_gradient(self, posterior: JointPosterior, places: Array) -> tuple[Array, Array]:
        trajectory = self.quantity.trajectory
        looks = {name: _value_and_gradient(q, posterior, places) for name, q in trajectory.arguments}
        values = {name: value for name, (value, _) in looks.items()}
        slopes = trajectory.slopes(values)
        gradients = (slopes[name] * gradient for name, (_, gradient) in looks.items())
        with np.errstate(invalid="ignore"):
            return trajectory.value(values), np.asarray(sum(gradients))


def _value_and_gradient(functional: Functional, posterior: JointPosterior, places: Array) -> tuple[Array, Array]:
    value = np.full(len(places), float(functional.offset))
    gradient = np.zeros((len(posterior.prior.learned), len(places)))
    for c, weights in functional.rounded:
        jet, by_theta = posterior.jet_and_gradient(c, functional.instants(places, len(weights)), 0)
        value += weights @ jet[0]
        gradient += weights @ by_theta[:, 0]
    return value, gradient
