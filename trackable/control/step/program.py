"""The convex programs of a controller: built once, with parameters for everything that changes from step to step."""

from dataclasses import dataclass

import cvxpy as cp
import numpy as np

from trackable.arrays import Array
from trackable.control.step.error_model import ErrorModel
from trackable.control.step.scales import Scales
from trackable.control.step.slack import Slack
from trackable.control.step.variables import StepVariables
from trackable.systems.constrained import ConstrainedSystem

# An interior-point method without warm start: the result depends on the parameters only, not on earlier steps. The
# first tolerance is tighter than the solver's default (1e-8), because a cost of 1e-8 is an error of 1e-4. The next
# tolerance is tried where float64 does not reach it.
_SOLVER = cp.CLARABEL
_TOLERANCES = (1e-12, 1e-10, 1e-8)
_MAX_ITERATIONS = 50
_CONCLUSIVE = (cp.OPTIMAL, cp.INFEASIBLE)


@dataclass(frozen=True, eq=False)
class Program:
    """A convex program in the variables of a step. ValueError where cvxpy would have to build it again at each step."""

    variables: StepVariables
    problem: cp.Problem

    def __post_init__(self) -> None:
        if not self.problem.is_dcp(dpp=True):
            raise ValueError("program: must be convex, and affine in its parameters")

    def solve(
        self, model: ErrorModel, initial_error: Array, defects: Array, slack: Slack, terminal_error: Array
    ) -> Array | None:
        """Return the optimal input errors v (N, m); None where the solver finds no solution, for whatever reason.

        All numbers are scaled. Raises ArithmeticError where one is not finite.
        """
        self.variables.assign(model, initial_error, defects, slack, terminal_error)
        found = optimal_values(self.problem)
        return None if found is None else np.asarray(found[self.variables.v.id])


def optimal_values(problem: cp.Problem) -> dict[int, Array] | None:
    """Return the optimal values of a program's variables, by their ids; None where the solver finds no solution.

    Raises ArithmeticError where a parameter is not finite.
    """
    if not all(np.all(np.isfinite(parameter.value)) for parameter in problem.parameters()):
        raise ArithmeticError("the numbers of its program are not finite")
    data, chain, inverse = problem.get_problem_data(_SOLVER, solver_opts={})
    for tolerance in _TOLERANCES:
        options = dict.fromkeys(("tol_gap_abs", "tol_gap_rel", "tol_feas"), tolerance)
        options["max_iter"] = _MAX_ITERATIONS
        raw = chain.solve_via_data(problem, data, warm_start=False, verbose=False, solver_opts=options)
        solution = chain.invert(raw, inverse)
        if solution.status in _CONCLUSIVE:
            break
    return dict(solution.primal_vars) if solution.status == cp.OPTIMAL else None


def tracking_program(plant: ConstrainedSystem, horizon: int, scales: Scales, Q: Array, R: Array) -> Program:
    """min Σ_(i<N) ‖e(i)‖²_Q + ‖v(i)‖²_R with e(N) as given (zero: on the reference) and e, v within their slack."""
    s = StepVariables.of(plant, horizon)
    scaled_Q, scaled_R = scales.weights(Q, R)
    cost = squared(s.e[:-1], scaled_Q) + squared(s.v, scaled_R)
    return Program(s, cp.Problem(cp.Minimize(cost), [*s.dynamics(), *s.bounds(plant, scales), s.ends()]))


def widening_program(plant: ConstrainedSystem, horizon: int, scales: Scales) -> Program:
    """The least part of their widths by which all sets must grow (or the most they may shrink) for the given e(N)."""
    s = StepVariables.of(plant, horizon)
    widening = cp.Variable()
    return Program(s, cp.Problem(cp.Minimize(widening), [*s.dynamics(), *s.bounds(plant, scales, widening), s.ends()]))


def terminal_error_program(plant: ConstrainedSystem, horizon: int, scales: Scales) -> Program:
    """min ‖e(N)‖ (Euclidean, in scales) with e, v within their slack. The minimiser e(N) is unique, the plan is not."""
    s = StepVariables.of(plant, horizon)
    missed = cp.sum_squares(s.e[horizon])
    return Program(s, cp.Problem(cp.Minimize(missed), [*s.dynamics(), *s.bounds(plant, scales)]))


def squared(rows: cp.Expression, weight: Array) -> cp.Expression:
    """Σ_i ‖row_i‖² in the norm of `weight`."""
    return cp.quad_form(cp.vec(rows, order="C"), np.kron(np.eye(rows.shape[0]), weight), assume_PSD=True)
