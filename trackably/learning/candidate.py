"""A point of the search, with the values of the objective and the constraints there."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from trackably.arrays import Array
from trackably.gp.joint import JointPosterior
from trackably.gp.remembered import Remembered
from trackably.learning.constraint import closest
from trackably.learning.problem import ConstrainedProblem, NothingFeasible

_SAME_TIME = 1e-9

Places = tuple[Array, ...]
"""One array of places for each constraint of a problem."""


@dataclass(frozen=True)
class Candidate:
    """A point ln θ with its posterior, its objective l, and each constraint's local `minima` (places and margins)."""

    log_theta: Array
    posterior: JointPosterior
    objective: float
    minima: tuple[tuple[Array, Array], ...]

    @classmethod
    def at(cls, problem: ConstrainedProblem, log_theta: Array) -> "Candidate":
        """Evaluate the problem. Raises IllConditioned."""
        posterior = problem.posterior(log_theta)
        objective, _ = posterior.negative_log_marginal_likelihood()
        minima = tuple(closest(problem.constraints, Remembered.of(posterior.signals)))
        return cls(log_theta, posterior, objective, minima)

    def with_overlooked(self, problem: ConstrainedProblem) -> "Candidate":
        """Add the places where a bound is violated that the coarse grid of `closest` missed."""
        added = [constraint.overlooked(self.posterior) for constraint in problem.constraints]
        minima = [
            (np.concatenate([places, more]), np.concatenate([margins, below]))
            for (places, margins), (more, below) in zip(self.minima, added, strict=True)
        ]
        return replace(self, minima=tuple(minima))

    @cached_property
    def worst(self) -> tuple[float, int, float]:
        """The smallest relative margin, the index of the constraint that has it, and the time [s]."""
        found = [
            (margin, i, time)
            for i, (places, margins) in enumerate(self.minima)
            for time, margin in zip(places.reshape(len(margins), -1)[:, 0].tolist(), margins.tolist(), strict=True)
        ]
        return min(found, default=(np.inf, -1, np.nan))

    @property
    def is_feasible(self) -> bool:
        return all(bool(np.all(margins >= 0)) for _, margins in self.minima)

    @property
    def closest_places(self) -> Places:
        """The places where margins are smallest and defined."""
        return tuple(places[np.isfinite(margins)] for places, margins in self.minima)

    def violated(self, known: Places) -> Places | None:
        """Return the places where a bound is violated; None if all of them are `known`.

        Places where the quantity is not defined are left out, because it has no gradient there: another constraint has
        to lead the search back to its domain.
        """
        found = tuple(places[(margins < 0) & np.isfinite(margins)] for places, margins in self.minima)
        return found if any(len(m) > len(k) for m, k in zip(merged(known, found), known, strict=True)) else None

    def infeasible(self, problem: ConstrainedProblem) -> NothingFeasible:
        """Explain which bound is violated most; call it for the candidate with the smallest violation."""
        margin, index, time = self.worst
        quantity = problem.constraints[index].quantity
        return NothingFeasible(self.posterior, quantity, time, -margin * quantity.bounds.width, problem.broken_at_rest)


def merged(known: Places, new: Places) -> Places:
    """Return, for each constraint, the union of known and new places, sorted."""
    return tuple(_united(*pair) for pair in zip(known, new, strict=True))


def _united(places: Array, new: Array) -> Array:
    """Sort by the first number of each place."""
    fresh = [place for place in new if not len(places) or np.min(_distances(places, place)) > _SAME_TIME]
    joined = np.concatenate([places, np.array(fresh).reshape(-1, *places.shape[1:])])
    return joined[np.argsort(joined if joined.ndim == 1 else joined[:, 0], kind="stable")]


def _distances(places: Array, place: Array) -> Array:
    return np.asarray(np.max(np.abs(places - place).reshape(len(places), max(1, np.size(place))), axis=1))
