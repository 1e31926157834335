"""The problem with constraints at finitely many places: a nonlinear program in ln θ, with exact gradients."""

from dataclasses import dataclass, replace

import numpy as np

from trackable.arrays import Array
from trackable.gp.posterior import IllConditioned
from trackable.learning import sqp
from trackable.learning.problem import ConstrainedProblem


@dataclass(frozen=True)
class Program:
    """The `problem` with each constraint at given `places` only: one array for each constraint."""

    problem: ConstrainedProblem
    places: tuple[Array, ...]

    def minimise(
        self,
        start: Array,
        curvature: Array | None = None,
        precision: float = sqp.PRECISION,
        give_up: sqp.GiveUp = sqp.never,
        radius: float = sqp.FIRST_RADIUS,
    ) -> sqp.Minimum | None:
        """Return a local minimum from `start`; None where there is no value at `start`, or the search is given up.

        See `sqp.minimise` for the options.
        """
        space = self.problem.space
        return sqp.minimise(
            self.evaluate, start, space.log_lower, space.log_upper, radius, curvature, precision, give_up
        )

    def minimise_violation(
        self,
        start: Array,
        curvature: Array | None = None,
        precision: float = sqp.PRECISION,
        give_up: sqp.GiveUp = sqp.never,
    ) -> sqp.Minimum | None:
        """Return a local minimum of the largest relative violation; None where there is no value at `start`.

        The options are those of `minimise`. Two of them are not used: the curvature of the objective says nothing of
        the violation, and no objective ends the search.
        """

        def evaluate(log_theta: Array) -> sqp.Evaluation | None:
            if (at := self.evaluate(log_theta)) is None:
                return None
            return replace(at, value=0.0, gradient=np.zeros_like(at.gradient))

        space = self.problem.space
        return sqp.minimise(evaluate, start, space.log_lower, space.log_upper, precision=precision)

    def evaluate(self, log_theta: Array) -> sqp.Evaluation | None:
        """Return objective and slacks with their derivatives; None where one of them does not exist."""
        posterior = self.problem.posterior(log_theta)
        try:
            value, gradient = posterior.negative_log_marginal_likelihood()
        except IllConditioned:
            return None
        slack, jacobian = [np.empty(0)], [np.empty((0, len(log_theta)))]
        for constraint, places in zip(self.problem.constraints, self.places, strict=True):
            if len(places):
                bounds, backoff = constraint.quantity.bounds, constraint.backoff
                quantity, by_theta = constraint.value_and_gradient(posterior, places)
                if not (np.all(np.isfinite(quantity)) and np.all(np.isfinite(by_theta))):
                    return None
                slack += [
                    (side / bounds.width - backoff) for side in (quantity - bounds.lower, bounds.upper - quantity)
                ]
                jacobian += [by_theta.T / bounds.width, -by_theta.T / bounds.width]
        return sqp.Evaluation(value, gradient, np.concatenate(slack), np.concatenate(jacobian))
