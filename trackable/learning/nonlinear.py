"""The problem with constraints at finitely many places: a nonlinear program in ln θ, with exact gradients."""

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain
from typing import NamedTuple, Self

import numpy as np

from trackable.arrays import Array
from trackable.gp.joint import JointPosterior
from trackable.gp.posterior import IllConditioned
from trackable.learning.constraint import Arguments, Bounded, Constraint
from trackable.learning.problem import ConstrainedProblem
from trackable.learning.solvers import sqp


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
        found, sides = self._quantities(posterior), self._sides
        slacks = np.concatenate([found, found], axis=1)
        slacks *= sides.signs
        slacks[0] += sides.ends
        slacks /= sides.widths
        slacks[0] -= sides.backoffs
        information = posterior.information
        if not (np.isfinite(slacks).all() and np.isfinite(information).all()):
            return None
        return sqp.Evaluation(value, gradient, slacks[0], slacks[1:].T, information)

    def _quantities(self, posterior: JointPosterior) -> Array:
        """Return all quantities at their places and their ∂/∂ln θ: shape (1 + p, Σ n)."""
        of_arguments, parts, start = self._arguments.values_and_gradients(posterior), list[Array](), 0
        for constraint, places in self._asked:
            if isinstance(constraint, Constraint):
                end = start + len(constraint.quantity.trajectory.arguments) * len(places)
                parts.append(constraint.of_arguments(of_arguments[:, start:end]))
                start = end
            else:
                value, gradient = constraint.value_and_gradient(posterior, places)
                parts.append(np.concatenate([value[None], gradient]))
        return np.concatenate(parts, axis=1) if parts else of_arguments

    @cached_property
    def _asked(self) -> list[tuple[Bounded, Array]]:
        """The constraints that have places."""
        pairs = zip(self.problem.constraints, self.places, strict=True)
        return [(constraint, places) for constraint, places in pairs if len(places)]

    @cached_property
    def _arguments(self) -> Arguments:
        """The arguments of all constraints that are functions of functionals, one constraint after the other."""
        timed = (each.asked(places) for each, places in self._asked if isinstance(each, Constraint))
        return Arguments([*chain.from_iterable(timed)])

    @cached_property
    def _sides(self) -> "_Sides":
        return _Sides.of(self._asked)


class _Sides(NamedTuple):
    """Slacks ± (q − bound)/width − backoff at all places of all constraints: first of lower bounds, then of upper."""

    signs: Array
    ends: Array
    widths: Array
    backoffs: Array

    @classmethod
    def of(cls, asked: list[tuple[Bounded, Array]]) -> Self:
        counts, bounds = [len(places) for _, places in asked], [each.quantity.bounds for each, _ in asked]
        each_side = [
            [(1.0, -b.lower, b.width, of.backoff) for b, (of, _) in zip(bounds, asked, strict=True)],
            [(-1.0, b.upper, b.width, of.backoff) for b, (of, _) in zip(bounds, asked, strict=True)],
        ]
        rows = np.array(each_side, dtype=float).reshape(-1, 4)
        return cls(*np.repeat(rows, counts * 2, axis=0).T)
