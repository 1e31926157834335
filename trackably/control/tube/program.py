"""The convex programs of a tube controller: as those of the nominal one, with the nominal start as a variable."""

from dataclasses import dataclass

import cvxpy as cp
import numpy as np

from trackably.arrays import Array
from trackably.control.convex.compiled import CompiledProgram
from trackably.control.step.error_model import ErrorModel
from trackably.control.step.program import squared
from trackably.control.step.scales import Scales
from trackably.control.step.slack import Inequalities, Slack
from trackably.control.step.variables import StepVariables
from trackably.control.tube.error_set import ErrorSet
from trackably.systems.constrained import ConstrainedSystem


@dataclass(frozen=True, eq=False)
class Membership:
    """The constraint x − z(0) ∈ Z on e(0) = (z(0) − x_r) / scales, affine in a parameter made of x − x_r."""

    errors: ErrorSet
    scales: Array
    parameter: cp.Parameter

    @classmethod
    def of(cls, errors: ErrorSet, scales: Array) -> "Membership":
        sides = _sides(errors)
        return cls(errors, scales, cp.Parameter(errors.dimension if sides is None else len(sides[0])))

    def constraints(self, start: cp.Expression) -> list[cp.Constraint]:
        """Return the constraints on the scaled e(0) (n,)."""
        if (sides := _sides(self.errors)) is not None:
            rows = sides[0] * self.scales
            return [-(rows / np.linalg.norm(rows, axis=1, keepdims=True)) @ start <= self.parameter]
        G = self.errors.generators.T / self.scales[:, None]
        weights = cp.Variable(G.shape[1])
        total, constraints = start + G @ weights, [weights <= 1, weights >= -1]
        N, v, n = self.errors.hulls.shape
        if N:  # a point of each hull
            parts = cp.Variable((N, v), nonneg=True)
            vertices = self.errors.hulls.reshape(N * v, n).T / self.scales[:, None]
            total = total + vertices @ cp.vec(parts, order="C")
            constraints.append(cp.sum(parts, axis=1) == 1)
        return [total == self.parameter, *constraints]

    def assign(self, off: Array) -> None:
        """Give the parameter its value for x − x_r = `off` (n,)."""
        if (sides := _sides(self.errors)) is not None:
            rows, limits = sides
            self.parameter.value = (limits - rows @ off) / np.linalg.norm(rows * self.scales, axis=1)
        else:
            self.parameter.value = (off - self.errors.centre) / self.scales


@dataclass(frozen=True, eq=False)
class TubeProgram:
    """A program in e(0), …, e(N) and v(0), …, v(N − 1), all scaled. It ends on the reference."""

    variables: StepVariables
    membership: Membership
    start_slack: cp.Parameter
    compiled: CompiledProgram

    @classmethod
    def tracking(
        cls, plant: ConstrainedSystem, horizon: int, scales: Scales, Q: Array, R: Array, errors: ErrorSet
    ) -> "TubeProgram":
        """Return min Σ_(i<N) ‖e(i)‖²_Q + ‖v(i)‖²_R with x − z(0) ∈ Z, z in X for all i < N, and v in U."""
        s = StepVariables.of(plant, horizon)
        scaled_Q, scaled_R = scales.weights(Q, R)
        return cls._of(s, plant, scales, errors, squared(s.e[:-1], scaled_Q) + squared(s.v, scaled_R), 0.0)

    @classmethod
    def terminal_error(cls, plant: ConstrainedSystem, horizon: int, scales: Scales, errors: ErrorSet) -> "TubeProgram":
        """Return min ‖e(N)‖ (Euclidean, in scales) with x − z(0) ∈ Z and all bounds kept."""
        s = StepVariables.of(plant, horizon)
        return cls._of(s, plant, scales, errors, cp.sum_squares(s.e[horizon]), 0.0, ends=False)

    @classmethod
    def widening(cls, plant: ConstrainedSystem, horizon: int, scales: Scales, errors: ErrorSet) -> "TubeProgram":
        """Return the least part of their widths by which all sets must grow, or the most they may shrink."""
        by = cp.Variable()
        return cls._of(StepVariables.of(plant, horizon), plant, scales, errors, by, by)

    @classmethod
    def _of(
        cls,
        s: StepVariables,
        plant: ConstrainedSystem,
        scales: Scales,
        errors: ErrorSet,
        cost: cp.Expression,
        widening: cp.Expression | float,
        ends: bool = True,
    ) -> "TubeProgram":
        membership = Membership.of(errors, scales.states)
        start_slack = cp.Parameter(2 * len(plant.state_set.rows))
        constraints = [*s.dynamics()[1:], *([s.ends()] if ends else []), *membership.constraints(s.e[0])]
        constraints += s.bounds(plant, scales, widening)
        if len(plant.state_set.rows):
            given = Inequalities.of(plant.state_set)
            rows = given.rows * scales.states / given.widths[:, None]
            constraints.append(rows @ s.e[0] <= start_slack + widening * np.ones(start_slack.shape))
        problem = cp.Problem(cp.Minimize(cost), constraints)
        return cls(s, membership, start_slack, CompiledProgram(problem))

    def solve(
        self, model: ErrorModel, off: Array, defects: Array, start_slack: Array, slack: Slack, end: Array
    ) -> tuple[Array, Array] | None:
        """Return the optimal scaled e(0) (n,) and v (N, m) with e(N) = `end`; None where the solver finds none.

        `off` (n,) is x − x_r in its unit, all else is scaled. Raises ArithmeticError where a number is not finite.
        """
        self.variables.assign(model, np.zeros_like(off), defects, slack, end)
        self.start_slack.value = start_slack
        self.membership.assign(off)
        found = self.compiled.solve()
        if found is None:
            return None
        return np.asarray(found[self.variables.e.id])[0], np.asarray(found[self.variables.v.id])


def _sides(errors: ErrorSet) -> tuple[Array, Array] | None:
    """Return the half-spaces of a polygon or an interval; of more states its parts make a smaller program."""
    return errors.halfspaces if errors.dimension <= 2 else None
