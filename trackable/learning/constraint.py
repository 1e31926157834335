"""Constraints of the learning problem: a quantity, its bounds, and the places (times) at which they have to hold."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Protocol

import numpy as np

from trackable.arrays import Array
from trackable.gp.joint import JointPosterior
from trackable.gp.kernels.base import Kernel
from trackable.gp.signal import KernelSum
from trackable.learning.index_set import IndexSet, TimesAndMargins
from trackable.systems.flat.functional import Functional
from trackable.systems.quantities import Quantities
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
        """Return the times [s] between which `closest` may miss something, as the quantity may turn there.

        There are none where all kernels are analytic: a signal then turns as slowly at its centres as anywhere.
        """
        if all(signal.kernel.is_analytic for signal in posterior.signals):
            return self.none
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
        functionals = [(functional, places) for _, functional in self.quantity.trajectory.arguments]
        return self.of_arguments(Arguments(functionals).values_and_gradients(posterior))

    def of_arguments(self, found: Sequence[tuple[Array, Array]]) -> tuple[Array, Array]:
        """Return `value_and_gradient` from those of the trajectory's arguments."""
        trajectory = self.quantity.trajectory
        if trajectory.functional is not None:
            return found[0]
        names = [name for name, _ in trajectory.arguments]
        values = {name: value for name, (value, _) in zip(names, found, strict=True)}
        slopes = trajectory.slopes(values)
        gradients = (slopes[name] * gradient for name, (_, gradient) in zip(names, found, strict=True))
        with np.errstate(invalid="ignore"):
            return trajectory.value(values), np.asarray(sum(gradients))


def local_minima(
    constraints: Sequence[Constraint],
    kernels: Sequence[Kernel],
    together: Callable[[Sequence[Constraint]], Quantities],
) -> list[TimesAndMargins]:
    """Return the local minima of each relative margin; those of one index set are sought `together`."""
    found = dict[int, TimesAndMargins]()
    for index_set in dict.fromkeys(constraint.index_set for constraint in constraints):
        members = [i for i, constraint in enumerate(constraints) if constraint.index_set == index_set]
        several = together([constraints[i] for i in members])
        for i, (at, margins) in zip(members, index_set.minima_of_each(several, kernels), strict=True):
            found[i] = at, margins / constraints[i].quantity.bounds.width
    return [found[i] for i in range(len(constraints))]


def closest(constraints: Sequence[Bounded], posterior: Signalled) -> list[TimesAndMargins]:
    """Return what is `closest` for each constraint; those with index sets are evaluated together."""
    timed = [constraint for constraint in constraints if isinstance(constraint, Constraint)]

    def together(some: Sequence[Constraint]) -> Quantities:
        return Quantities(tuple(constraint.quantity for constraint in some), posterior.signals)

    found = iter(local_minima(timed, [signal.kernel for signal in posterior.signals], together))
    return [next(found) if isinstance(each, Constraint) else each.closest(posterior) for each in constraints]


@dataclass(frozen=True)
class Arguments:
    """Functionals, each with the places (n,) [s] at which it is asked for; each signal is evaluated once, for all."""

    functionals: Sequence[tuple[Functional, Array]]

    def values_and_gradients(self, posterior: JointPosterior) -> list[tuple[Array, Array]]:
        """Return each functional at its places, and its ∂/∂ln θ: shapes (n,) and (p, n)."""
        (times, terms), p, found = self._asked, len(posterior.prior.learned), []
        signals = {c: posterior.jet_and_gradient(c, of_signal, 0) for c, of_signal in times.items()}
        for (functional, places), of_functional in zip(self.functionals, terms, strict=True):
            value, gradient = np.full(len(places), float(functional.offset)), np.zeros((p, len(places)))
            for c, weights, at in of_functional:
                jet, by_theta = signals[c]
                value += weights @ jet[0, at].reshape(len(weights), len(places))
                gradient += weights @ by_theta[:, 0, at].reshape(p, len(weights), len(places))
            found.append((value, gradient))
        return found

    @cached_property
    def _asked(self) -> tuple[dict[int, Array], list[list[tuple[int, Array, slice]]]]:
        """Times [s] at which each signal c is needed; for each functional its signals c, weights, and their times."""
        times, terms = dict[int, list[Array]](), list[list[tuple[int, Array, slice]]]()
        for functional, places in self.functionals:
            terms.append([])
            for c, weights in functional.rounded:
                of_signal, shifts = times.setdefault(c, []), _shifts(weights)
                start = sum(map(len, of_signal))
                of_signal += [places + j * functional.sampling_time for j in shifts]
                terms[-1].append((c, weights[shifts], slice(start, start + len(shifts) * len(places))))
        return {c: np.concatenate(parts) for c, parts in times.items()}, terms


def _shifts(weights: Array) -> list[int]:
    """Return the shifts j that matter; of several ones all, as sums are taken over all shifts in one order."""
    shifts: list[int] = np.flatnonzero(weights).tolist()
    return shifts if len(shifts) == 1 else list(range(len(weights)))
