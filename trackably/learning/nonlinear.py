"""The problem with constraints at finitely many places: a nonlinear program in ln θ, with exact gradients."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from trackably.arrays import Array
from trackably.gp.joint import JointPosterior
from trackably.gp.posterior import IllConditioned
from trackably.learning import sqp
from trackably.learning.constraint import Bounded, Constraint, Sums, of_arguments
from trackably.learning.problem import ConstrainedProblem


@dataclass(frozen=True)
class Program:
    """The `problem` with each constraint only at its given `places`: one array for each constraint."""

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
        """Return a local minimum found from `start`; None if the objective is undefined there, or the search is given
        up.

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
        """Return a local minimum of the largest relative violation; None if it is undefined at `start`.

        The options are those of `minimise`. `curvature` and `give_up` are ignored, because they belong to the
        objective.
        """

        def evaluate(log_theta: Array) -> sqp.Evaluation | None:
            if (at := self.evaluate(log_theta)) is None:
                return None
            return replace(at, value=0.0, gradient=np.zeros_like(at.gradient), information=None)

        space = self.problem.space
        return sqp.minimise(evaluate, start, space.log_lower, space.log_upper, precision=precision)

    def evaluate(self, log_theta: Array) -> sqp.Evaluation | None:
        """Return objective and slacks with their derivatives; None if one of them is not finite."""
        posterior = self.problem.posterior(log_theta)
        try:
            value, gradient = posterior.negative_log_marginal_likelihood()
        except IllConditioned:
            return None
        found, linear = self._sums.values_and_gradients(posterior), self._slacks_of_functionals
        slacks = np.concatenate([found[:, :linear], *self._of_formulas(posterior, found[:, linear:])], axis=1)
        information = posterior.information
        if not (np.isfinite(slacks).all() and np.isfinite(information).all()):
            return None
        return sqp.Evaluation(value, gradient, slacks[0], slacks[1:].T, information)

    def _of_formulas(self, posterior: JointPosterior, arguments: Array) -> Iterator[Array]:
        """Yield the slacks of each constraint that is a formula, from the `arguments` of all formulas."""
        for constraint, places in self._others:
            if isinstance(constraint, Constraint):
                count = len(constraint.quantity.trajectory.arguments) * len(places)
                own, arguments = arguments[:, :count], arguments[:, count:]
                quantity = of_arguments(constraint.quantity.trajectory, own)
            else:
                value, gradient = constraint.value_and_gradient(posterior, places)
                quantity = np.concatenate([value[None], gradient])
            yield constraint.slacks(quantity, places)

    @cached_property
    def _sums(self) -> Sums:
        """The slacks of the constraints that are linear functionals, then the arguments of all formulas."""
        timed = [(each, at) for each, at in (*self._functionals, *self._others) if isinstance(each, Constraint)]
        sums = Sums.of([pair for constraint, places in timed for pair in constraint.arguments_at(places)])
        parts, end = list[tuple[Array, Array]](), 0
        for constraint, places in self._functionals:
            start, end = end, end + len(places)
            parts.append((np.tile(sums.at[:, start:end], 2), constraint.slacks(sums.weights[:, start:end], places)))
        at, weights = zip(*parts, (sums.at[:, end:], sums.weights[:, end:]), strict=True)
        return Sums(sums.times, np.concatenate(at, axis=1), np.concatenate(weights, axis=1))

    @cached_property
    def _slacks_of_functionals(self) -> int:
        """The number of slacks of linear functionals, which come first in `_sums`."""
        return sum(2 * len(places) for _, places in self._functionals)

    @cached_property
    def _functionals(self) -> list[tuple[Constraint, Array]]:
        """The constraints that are linear functionals, with their places; those without places are left out."""
        return [(each, places) for each, places in self._asked if isinstance(each, Constraint) and each.is_functional]

    @cached_property
    def _others(self) -> list[tuple[Bounded, Array]]:
        """The constraints that are formulas, with their places; those without places are left out."""
        return [(of, at) for of, at in self._asked if not (isinstance(of, Constraint) and of.is_functional)]

    @cached_property
    def _asked(self) -> list[tuple[Bounded, Array]]:
        pairs = zip(self.problem.constraints, self.places, strict=True)
        return [(constraint, places) for constraint, places in pairs if len(places)]
