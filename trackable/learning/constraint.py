"""Constraints of the learning problem: a quantity, its bounds, and the places (times) at which they have to hold."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import partial
from typing import Protocol

import numpy as np

from trackable.arrays import Array
from trackable.gp.joint import JointPosterior
from trackable.gp.signal import KernelSum
from trackable.learning.index_set import IndexSet
from trackable.systems.flat.functional import Functional
from trackable.systems.quantity import Quantity

# Bounds are drawn in by this part of their width: the optimiser's rounding errors are smaller.
ROUNDING_BACKOFF = 1e-9
PARTS = 8  # into which the time between two places is divided


class Signalled(Protocol):
    """What has signals: a posterior, or a function learned under bounds."""

    @property
    def signals(self) -> tuple[KernelSum, ...]: ...


class Bounded(ABC):
    """A quantity that has to stay inside its bounds, which are drawn in by `backoff` (a part of their width).

    Each row of an array of places is one place: a time, or several times in subclasses that need them.
    """

    quantity: Quantity
    backoff: float

    @property
    @abstractmethod
    def none(self) -> Array:
        """An empty array of places."""

    @abstractmethod
    def closest(self, posterior: Signalled) -> tuple[Array, Array]:
        """Return the places of the margin's local minima, and the relative margins (n,) there.

        A relative margin is a part of the bounds' width: negative where they are violated, 1/2 at the centre.
        """

    def overlooked(self, posterior: Signalled) -> tuple[Array, Array]:
        """Return places where a bound is violated that the coarse grid of `closest` missed, and relative margins."""
        return self.none, np.empty(0)

    def between(self, posterior: Signalled, places: Array) -> tuple[Array, Array]:
        """Return places between neighbouring `places` where a bound is violated, and relative margins."""
        return self.none, np.empty(0)

    @abstractmethod
    def value_and_gradient(self, posterior: JointPosterior, places: Array) -> tuple[Array, Array]:
        """Return the quantity at n places and its ∂/∂ln θ: shapes (n,), (p, n); NaN or infinite where not defined."""


@dataclass(frozen=True)
class Constraint(Bounded):
    """A quantity at all times of an index set; a place is a time [s]."""

    quantity: Quantity
    index_set: IndexSet
    backoff: float = ROUNDING_BACKOFF

    @property
    def none(self) -> Array:
        return np.empty(0)

    def closest(self, posterior: Signalled) -> tuple[Array, Array]:
        margin = partial(self.relative_margin, posterior)
        times = self.index_set.local_minima(margin, [signal.kernel for signal in posterior.signals])
        return times, margin(times)

    def overlooked(self, posterior: Signalled) -> tuple[Array, Array]:
        times, margins = self.unseen(posterior)
        rough, broken = self.between(posterior, self.examined(posterior))
        return np.concatenate([times, rough]), np.concatenate([margins, broken])

    def unseen(self, posterior: Signalled) -> tuple[Array, Array]:
        """Return the times and relative margins of violations between the times that `closest` has seen."""
        margin, curvature = partial(self.relative_margin, posterior), partial(self._curvature, posterior)
        times = self.index_set.overlooked(margin, [signal.kernel for signal in posterior.signals], curvature)
        return times, margin(times) if len(times) else np.empty(0)

    def examined(self, posterior: Signalled) -> Array:
        """Return the times [s] between which `closest` may miss something, as the quantity may turn there."""
        return self.index_set.examined(self._turns(posterior))

    def between(self, posterior: Signalled, places: Array) -> tuple[Array, Array]:
        if len(places) < 2:
            return self.none, np.empty(0)
        times = self.index_set.nearest(np.linspace(places[:-1], places[1:], PARTS + 1)[1:-1])
        margins = self.relative_margin(posterior, times)
        lowest, pick = np.argmin(margins, axis=0), np.arange(len(places) - 1)
        at, margin = times[lowest, pick], margins[lowest, pick]
        return at[margin < 0], margin[margin < 0]

    def _turns(self, posterior: Signalled) -> Array:
        """Return the times at which the quantity may turn: q(t) = Σ_j w_j g(t + j T_s) has each kink of g J + 1 times.

        Kinks are at centres. Signals without kinks turn near centres, more slowly than in a few T_s.
        """
        found = [signal.centres for signal in posterior.signals]
        for _, functional in self.quantity.trajectory.arguments:
            for c, weights in functional.rounded:
                if not posterior.signals[c].kernel.is_analytic:
                    shifts = functional.sampling_time * np.arange(len(weights))
                    found.append(np.subtract.outer(posterior.signals[c].centres, shifts).ravel())
        return np.unique(np.concatenate(found))

    def relative_margin(self, posterior: Signalled, t: Array) -> Array:
        """Return the distance to the nearer bound at t [s] as a part of the bounds' width: negative where violated."""
        return self.quantity.margin(posterior.signals, t) / self.quantity.bounds.width

    def _curvature(self, posterior: Signalled) -> float:
        """Return a bound of |d²/dt²| of the relative margin [1/s²], an over-estimate; infinite for formulas."""
        if (functional := self.quantity.functional) is None:
            return np.inf
        moved = (float(np.sum(np.abs(w))) * posterior.signals[c].curvature for c, w in functional.rounded)
        return sum(moved) / self.quantity.bounds.width

    def value_and_gradient(self, posterior: JointPosterior, places: Array) -> tuple[Array, Array]:
        trajectory = self.quantity.trajectory
        arguments = {name: _value_and_gradient(q, posterior, places) for name, q in trajectory.arguments}
        values = {name: value for name, (value, _) in arguments.items()}
        slopes = trajectory.slopes(values)
        gradients = (slopes[name] * gradient for name, (_, gradient) in arguments.items())
        with np.errstate(invalid="ignore"):
            return trajectory.value(values), np.asarray(sum(gradients))


def _value_and_gradient(functional: Functional, posterior: JointPosterior, places: Array) -> tuple[Array, Array]:
    value = np.full(len(places), float(functional.offset))
    gradient = np.zeros((len(posterior.prior.learned), len(places)))
    for c, weights in functional.rounded:
        shifts = np.flatnonzero(weights)
        if len(shifts) > 1:  # sums are taken over all shifts, in one order
            shifts = np.arange(len(weights))
        at = np.stack([places + j * functional.sampling_time for j in shifts])
        jet, by_theta = posterior.jet_and_gradient(c, at, 0)
        value += weights[shifts] @ jet[0]
        gradient += weights[shifts] @ by_theta[:, 0]
    return value, gradient
