"""The problem with constraints at finitely many places: a nonlinear program in ln θ, with exact gradients."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from trackably.arrays import Array
from trackably.gp.joint import JointPosterior
from trackably.gp.posterior import IllConditioned
from trackably.gp.rows import Rows
from trackably.learning import sqp
from trackably.learning.constraint import Constraint, of_arguments, rows_of, values_and_gradients
from trackably.learning.index_set import SeveralTimes
from trackably.learning.problem import ConstrainedProblem


@dataclass(frozen=True)
class Program:
    """The `problem` with each constraint imposed at finitely many `places` (times): an array for each constraint.

    A program that `restores` feasibility has no objective: its minimum is a local minimum of the largest relative
    violation.
    """

    problem: ConstrainedProblem
    places: tuple[Array, ...]
    restores: bool = False

    def evaluate(self, log_theta: Array) -> sqp.Evaluation | None:
        """Return objective and slacks at ln θ with their derivatives.

        None if K + σ_n² I cannot be factored, or if a slack or its derivative is not finite.
        """
        posterior = self.problem.posterior(log_theta)
        try:
            value, gradient = posterior.negative_log_marginal_likelihood()
        except IllConditioned:
            return None
        slacks = np.concatenate([np.empty((1 + len(log_theta), 0)), *self._slacks(posterior)], axis=1)
        information = posterior.information
        if not (np.isfinite(slacks).all() and np.isfinite(information).all()):
            return None
        if self.restores:
            return sqp.Evaluation(0.0, np.zeros_like(gradient), slacks[0], slacks[1:].T)
        return sqp.Evaluation(value, gradient, slacks[0], slacks[1:].T, information)

    def _slacks(self, posterior: JointPosterior) -> Iterator[Array]:
        """Yield, for each constraint with n > 0 places (times), its slacks and below their p derivatives ∂/∂ln θ_j.

        Each array has shape (1 + p, 2 n): first the slacks of lower bounds, then those of upper bounds.
        """
        arguments = values_and_gradients(self._arguments, posterior)
        for constraint, places in self._placed:
            if isinstance(constraint.index_set, SeveralTimes):
                value, gradient = constraint.index_set.value_and_gradient(posterior, places)
                quantity = np.concatenate([value[None], gradient])
            else:
                count = len(constraint.quantity.arguments) * len(places)
                own, arguments = arguments[:, :count], arguments[:, count:]
                quantity = of_arguments(constraint.quantity, own)
            yield constraint.slacks(quantity, places)

    @cached_property
    def _arguments(self) -> Rows:
        """Rows that evaluate all functionals on which the quantities depend, at the times of their constraints."""
        timed = [(each, places) for each, places in self._placed if not isinstance(each.index_set, SeveralTimes)]
        functionals = [(of, places) for constraint, places in timed for _, of in constraint.quantity.arguments]
        return rows_of(functionals, len(self.problem.prior.parts))

    @cached_property
    def _placed(self) -> list[tuple[Constraint, Array]]:
        """The constraints with their places (times); constraints without places are left out."""
        pairs = zip(self.problem.constraints, self.places, strict=True)
        return [(constraint, places) for constraint, places in pairs if len(places)]
