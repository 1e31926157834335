"""The problem with constraints at finitely many places: a nonlinear program in ln θ, with exact gradients."""

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice

import numpy as np

from trackable.arrays import Array
from trackable.gp.posterior import IllConditioned
from trackable.learning import sqp
from trackable.learning.constraint import Arguments, Bounded, Constraint
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
            return replace(at, value=0.0, gradient=np.zeros_like(at.gradient), information=None)

        space = self.problem.space
        return sqp.minimise(evaluate, start, space.log_lower, space.log_upper, precision=precision)

    def evaluate(self, log_theta: Array) -> sqp.Evaluation | None:
        """Return objective and slacks with their derivatives; None where one of them does not exist."""
        posterior = self.problem.posterior(log_theta)
        try:
            value, gradient = posterior.negative_log_marginal_likelihood()
        except IllConditioned:
            return None
        slacks, jacobians = [np.empty(0)], [np.empty((0, len(log_theta)))]
        arguments = iter(self._arguments.values_and_gradients(posterior))
        for constraint, places in self._asked:
            bounds, backoff = constraint.quantity.bounds, constraint.backoff
            if isinstance(constraint, Constraint):
                count = len(constraint.quantity.trajectory.arguments)
                quantity, by_theta = constraint.of_arguments([*islice(arguments, count)])
            else:
                quantity, by_theta = constraint.value_and_gradient(posterior, places)
            slacks += [(side / bounds.width - backoff) for side in (quantity - bounds.lower, bounds.upper - quantity)]
            relative = by_theta.T / bounds.width
            jacobians += [relative, -relative]
        slack, jacobian = np.concatenate(slacks), np.concatenate(jacobians)
        information = posterior.information
        if not all(np.isfinite(found).all() for found in (slack, jacobian, information)):
            return None
        return sqp.Evaluation(value, gradient, slack, jacobian, information)

    @cached_property
    def _asked(self) -> list[tuple[Bounded, Array]]:
        """The constraints that have places."""
        pairs = zip(self.problem.constraints, self.places, strict=True)
        return [(constraint, places) for constraint, places in pairs if len(places)]

    @cached_property
    def _arguments(self) -> Arguments:
        """The arguments of all constraints that are functions of functionals, one constraint after the other."""
        known = [(constraint, places) for constraint, places in self._asked if isinstance(constraint, Constraint)]
        return Arguments([(q, places) for of, places in known for _, q in of.quantity.trajectory.arguments])
