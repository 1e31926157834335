"""Search for hyperparameters and function together: local minima of J(θ) = l(θ) + D(θ) from given starts."""

from dataclasses import dataclass

import numpy as np

from trackable.arrays import Array
from trackable.gp.posterior import IllConditioned
from trackable.gp.signal import KernelSum
from trackable.learning import sqp
from trackable.learning.joint.bent import bent_mean
from trackable.learning.joint.places import Places
from trackable.learning.joint.settle import Settled, is_same, merged, no_places, same_time, settled
from trackable.learning.problem import ConstrainedProblem

_MAX_ROUNDS = 30
_SAME_VALUE = 1e-9
_PRECISION = 1e-11  # of J: the covariances of rows are not more precise
_SAME_THETA = 1e-7  # of ln θ
_NEARBY = 0.1
# A function that breaks bounds by less, as a part of their width, is one whose evaluation is rounded: a larger
# back-off will mend it, and no other start.
_ALMOST = 1e-3


@dataclass(frozen=True)
class JointProgram:
    """J(θ) with bounds at given `places` only: a relaxation. Formulas are linearised at the signals `near` first."""

    problem: ConstrainedProblem
    places: Places
    near: tuple[KernelSum, ...]

    def minimise(self, start: Array, curvature: Array | None) -> sqp.Minimum | None:
        """Return a local minimum from `start`; None where J has no value there."""
        lower, upper = self.problem.space.log_lower, self.problem.space.log_upper
        return sqp.minimise(self.evaluate, start, lower, upper, _NEARBY, curvature, _PRECISION)

    def evaluate(self, log_theta: Array) -> sqp.Evaluation | None:
        """Return J with its gradient, which the envelope theorem gives; None where J has no value."""
        posterior = self.problem.posterior(log_theta)
        try:
            value, gradient = posterior.negative_log_marginal_likelihood()
            bent = bent_mean(self.problem, posterior, self.places, self.near)
        except IllConditioned:
            return None
        if bent is None:
            return None
        by_theta = gradient + bent.price_gradient()
        return sqp.Evaluation(value + bent.price, by_theta, np.empty(0), np.empty((0, len(log_theta))))


@dataclass(frozen=True)
class Point:
    """ln θ with l(θ) = `nlml`, and the function at all times."""

    log_theta: Array
    nlml: float
    function: Settled

    @property
    def objective(self) -> float:
        """J = l + D."""
        return self.nlml + self.function.bent.price

    @property
    def is_solution(self) -> bool:
        """Whether the function keeps its bounds, up to what a back-off mends."""
        return not self.function.bent.contradicts and self.function.margin > -_ALMOST


@dataclass
class JointSearch:
    """Follow starts to local minima of J: `best` is the best point, `closest` the one that breaks bounds least.

    `fits` counts the programs in θ.
    """

    problem: ConstrainedProblem
    best: Point | None = None
    closest: Point | None = None
    fits: int = 0

    def follow(self, start: Array, places: Places | None = None, near: tuple[KernelSum, ...] | None = None) -> None:
        """Minimise J with bounds at the places met so far; settle the function at all times; repeat.

        Each program is a relaxation with more places than the last one. A relaxation that is no better than the best
        point ends the search; so does one that leaves θ and the places as they were, and a second contradiction: more
        places do not resolve it, and θ has just moved.
        """
        met = no_places(self.problem) if places is None else places
        point, curvature = self._at(start, met, near), None
        for _ in range(_MAX_ROUNDS):
            if point is None:
                return
            signals = point.function.bent.signals
            met = self._met(met, point)
            found = JointProgram(self.problem, met, signals).minimise(point.log_theta, curvature)
            self.fits += 1
            if found is None or self._is_no_better(found.at.value):
                return
            curvature, before = found.curvature, point
            point = self._at(found.x, met, signals)
            if point is None or (before.function.bent.contradicts and point.function.bent.contradicts):
                return
            if _is_same(point, before) and is_same(met, self._met(met, point)):
                return

    def _met(self, places: Places, point: Point) -> Places:
        """Return the places with those of the point."""
        return merged(places, point.function.places, same_time(point.function.bent.signals))

    def _at(self, log_theta: Array, places: Places, near: tuple[KernelSum, ...] | None) -> Point | None:
        """Return the point at ln θ, and remember it; None where it cannot be evaluated."""
        posterior = self.problem.posterior(log_theta)
        try:
            nlml, _ = posterior.negative_log_marginal_likelihood()
            function = settled(self.problem, posterior, places, near)
        except IllConditioned:
            return None
        if function is None:
            return None
        point = Point(log_theta, nlml, function)
        if point.is_solution and (self.best is None or point.objective < self.best.objective):
            self.best = point
        if self.closest is None or function.margin > self.closest.function.margin:
            self.closest = point
        return point

    def _is_no_better(self, value: float) -> bool:
        return self.best is not None and value >= self.best.objective - _SAME_VALUE * (1 + abs(self.best.objective))


def _is_same(one: Point, other: Point) -> bool:
    return bool(np.max(np.abs(one.log_theta - other.log_theta), initial=0.0) <= _SAME_THETA)
