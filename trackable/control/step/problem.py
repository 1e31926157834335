"""The problem of one step: its optimal plan, or how far the sets are from one."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from trackable.arrays import Array
from trackable.control.step.formulation import Formulation, LocalModel
from trackable.control.step.program import Program
from trackable.control.step.result import Infeasible, Plan, Status, StepResult
from trackable.control.step.slack import Slack
from trackable.systems.reference import Window

TOLERANCE = 1e-7
"""A step counts as feasible if it is feasible with every set widened by this part of its width.

Where a reference touches a bound, plans have no slack, and a state that has followed the last plan differs from it by
rounding and by the solver's accuracy: without a tolerance feasibility would be lost at such a step. A certified
reference itself keeps its bounds without any tolerance.
"""

_ROUNDING = 1e-12
"""A plan that violates a bound by no more than this part of a width counts as on it, as at rest on a bound."""


@dataclass(frozen=True, eq=False)
class StepProblem:
    """The problem of step `k`: the system's `state` (n,), the reference's `window` ahead, and the model of errors."""

    formulation: Formulation
    k: int
    state: Array
    window: Window
    model: LocalModel

    @cached_property
    def result(self) -> StepResult:
        """The optimal plan, or why there is none. Raises as `widest`."""
        return self.without_bounds() or self.solved() or self.widened_or_infeasible()

    @cached_property
    def initial_error(self) -> Array:
        """x(k) − x_r(k), shape (n,)."""
        return np.asarray(self.state - self.window.states[0])

    @cached_property
    def slack(self) -> Slack:
        """What the reference leaves for errors."""
        return Slack.along(self.formulation.inequalities, self.window)

    def without_bounds(self) -> Plan | None:
        """Return the optimum without bounds, if it keeps them."""
        unforced = self.model.error_model.unforced_errors(self.initial_error, self.model.defects)
        plan = self.plan(self.model.without_bounds.input_errors(unforced), Status.NO_ACTIVE_BOUND)
        return plan if plan.slack >= -_ROUNDING else None

    def solved(self) -> Plan | None:
        """Return the optimum with bounds, if the solver finds it."""
        return self._optimum(self.slack, Status.SOLVED)

    def widened_or_infeasible(self) -> StepResult:
        """Return the optimum with all sets widened by the tolerance, or say how much widening would be needed.

        Raises as `widest`.
        """
        if -self.widest.slack > TOLERANCE:
            return self._infeasible(self.widest)
        optimum = self._optimum(self.slack.widened(self.formulation.inequalities, TOLERANCE), Status.WIDENED)
        return optimum or self.widest

    @cached_property
    def widest(self) -> Plan:
        """The plan with the largest slack; where that is negative, the one that needs the least widening of the sets.

        Raises ArithmeticError where the solver fails, since this program always has a solution.
        """
        v = self._solve(self.formulation.widening, self.slack)
        if v is None:
            raise ArithmeticError(f"controller: the numbers of step {self.k} are beyond the solver")
        return self.plan(v, Status.WIDENED)

    def is_feasible(self, plan: Plan) -> bool:
        """Whether a plan ends on the reference and keeps the sets, up to twice the tolerance."""
        ends_on_reference = plan.terminal_residual <= TOLERANCE * max(1.0, float(np.max(np.abs(plan.states))))
        return ends_on_reference and plan.slack >= -2 * TOLERANCE

    def plan(self, v: Array, status: Status) -> Plan:
        """Return the plan with input errors v (N, m)."""
        f = self.formulation
        errors = self.model.error_model.errors(self.initial_error, v, self.model.defects)
        e = np.vstack([self.initial_error, errors])
        stage_costs = np.einsum("ia,ab,ib->i", e[:-1], f.Q, e[:-1]) + np.einsum("ia,ab,ib->i", v, f.R, v)
        return Plan(
            k=self.k,
            input=f.admissible.pull_inside(self.window.inputs[0] + v[0]),
            cost=float(np.sum(stage_costs)),
            stage_cost=float(stage_costs[0]),
            states=self.window.states + e,
            inputs=self.window.inputs + v,
            slack=self.slack.remaining(f.inequalities, errors, v).smallest,
            terminal_residual=float(np.max(np.abs(errors[-1]))),
            status=status,
        )

    def _optimum(self, slack: Slack, status: Status) -> Plan | None:
        v = self._solve(self.formulation.tracking, slack)
        if v is None:
            return None
        plan = self.plan(v, status)
        return plan if self.is_feasible(plan) else None

    def _solve(self, program: Program, slack: Slack) -> Array | None:
        return program.solve(self.model.error_model, self.initial_error, self.model.defects, slack)

    def _infeasible(self, widest: Plan) -> Infeasible:
        """Say how much widening the plan `widest` needs, and how close a plan comes to the reference without it."""
        f = self.formulation
        errors, v = widest.states[1:] - self.window.states[1:], widest.inputs - self.window.inputs
        quantity, steps_ahead = self.slack.remaining(f.inequalities, errors, v).tightest
        constraint = f.plant.given_constraints[quantity]
        v_closest = self._solve(f.terminal_error, self.slack.widened(f.inequalities, TOLERANCE))
        closest = None if v_closest is None else self.plan(v_closest, Status.WIDENED)
        return Infeasible(
            k=self.k,
            widening=-widest.slack,
            quantity=constraint.name,
            at_step=self.k + steps_ahead,
            excess=-widest.slack * constraint.bounds.width,
            terminal_error=None if closest is None else closest.states[-1] - self.window.states[-1],
            fallback=(closest or widest).input,
        )
