"""The convex programs of a controller: built once, with parameters for everything that changes from step to step."""

from dataclasses import dataclass

import cvxpy as cp
import numpy as np

from trackably.arrays import Array
from trackably.control.convex.compiled import CompiledProgram
from trackably.control.step.error_model import ErrorModel
from trackably.control.step.scales import Scales
from trackably.control.step.slack import Slack
from trackably.control.step.variables import StepVariables
from trackably.systems.constrained import ConstrainedSystem


@dataclass(frozen=True, eq=False)
class Program:
    """A convex program in the variables of a step."""

    variables: StepVariables
    compiled: CompiledProgram

    def solve(
        self, model: ErrorModel, initial_error: Array, defects: Array, slack: Slack, terminal_error: Array
    ) -> Array | None:
        """Return the optimal input errors v (N, m); None where the solver finds no solution, for whatever reason.

        All numbers are scaled. Raises ArithmeticError where one is not finite.
        """
        self.variables.assign(model, initial_error, defects, slack, terminal_error)
        found = self.compiled.solve()
        return None if found is None else np.asarray(found[self.variables.v.id])


def tracking_program(plant: ConstrainedSystem, horizon: int, scales: Scales, Q: Array, R: Array) -> Program:
    """Return min Σ_(i<N) ‖e(i)‖²_Q + ‖v(i)‖²_R with e(N) as given (0: on the reference), e and v within their slack."""
    s = StepVariables.of(plant, horizon)
    scaled_Q, scaled_R = scales.weights(Q, R)
    cost = squared(s.e[:-1], scaled_Q) + squared(s.v, scaled_R)
    return _compiled(s, cost, [*s.dynamics(), *s.bounds(plant, scales), s.ends()])


def widening_program(plant: ConstrainedSystem, horizon: int, scales: Scales) -> Program:
    """Return the least part of their widths by which all sets must grow, or the most they may shrink, for an e(N)."""
    s = StepVariables.of(plant, horizon)
    widening = cp.Variable()
    return _compiled(s, widening, [*s.dynamics(), *s.bounds(plant, scales, widening), s.ends()])


def terminal_error_program(plant: ConstrainedSystem, horizon: int, scales: Scales) -> Program:
    """Return min ‖e(N)‖ (Euclidean, in scales) with e, v within their slack: e(N) is unique then, the plan is not."""
    s = StepVariables.of(plant, horizon)
    missed = cp.sum_squares(s.e[horizon])
    return _compiled(s, missed, [*s.dynamics(), *s.bounds(plant, scales)])


def squared(rows: cp.Expression, weight: Array) -> cp.Expression:
    """Return Σ_i ‖row_i‖² in the norm of `weight`."""
    return cp.quad_form(cp.vec(rows, order="C"), np.kron(np.eye(rows.shape[0]), weight), assume_PSD=True)


def _compiled(variables: StepVariables, cost: cp.Expression, constraints: list[cp.Constraint]) -> Program:
    return Program(variables, CompiledProgram(cp.Problem(cp.Minimize(cost), constraints)))
