"""The problem with constraints at finitely many places: a nonlinear program in ln θ, with exact gradients."""

from dataclasses import dataclass

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

    def minimise(self, start: Array, radius: float = sqp.FIRST_RADIUS) -> Array | None:
        """Return ln θ of a local minimum from `start`; None where the problem cannot be evaluated at `start`."""
        return self._run(start, weight=1.0, radius=radius)

    def minimise_violation(self, start: Array) -> Array | None:
        """Return ln θ of a local minimum of the largest relative violation; None as in `minimise`."""
        return self._run(start, weight=0.0)

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

    def _run(self, start: Array, weight: float, radius: float = sqp.FIRST_RADIUS) -> Array | None:
        def evaluate(log_theta: Array) -> sqp.Evaluation | None:
            if (at := self.evaluate(log_theta)) is None:
                return None
            return at._replace(value=weight * at.value, gradient=weight * at.gradient)

        space = self.problem.space
        found = sqp.minimise(evaluate, start, space.log_lower, space.log_upper, radius)
        return None if found is None else found.x
