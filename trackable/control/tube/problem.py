"""The problem of one step of a tube controller: its optimal plan, or how far the tightened sets are from one."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from trackable.arrays import Array
from trackable.control.step.problem import ROUNDING, TOLERANCE, StepProblem
from trackable.control.step.result import Infeasible, Plan, Status
from trackable.control.tube.formulation import TubeFormulation
from trackable.control.tube.program import TubeProgram
from trackable.systems.reference import Window

_FOLLOWED = 1e-12
"""Of the scales: a reference that the system misses by less in each step is a plan."""


@dataclass(frozen=True, eq=False)
class TubeProblem:
    """The problem of step `k`: the measured `state` (n,), and the window of a reference ahead.

    Every result raises ArithmeticError where the numbers are beyond the solver or floating point.
    """

    formulation: TubeFormulation
    k: int
    state: Array
    window: Window

    @cached_property
    def optimum(self) -> Plan | None:
        """The optimal plan; None where none is found.

        Most steps need no program: inside of the tube the reference is the plan, and off the tube the start of least
        cost in x ⊖ Z will do, if no bound is active then.
        """
        try:
            return self.on_reference() or self.without_bounds() or self.with_active_bounds()
        except np.linalg.LinAlgError:  # beyond its numbers
            return self.solved()

    @cached_property
    def off(self) -> Array:
        """x − x_r, shape (n,)."""
        return np.asarray(self.state - self.window.states[0])

    @cached_property
    def nominal(self) -> StepProblem:
        """The problem of the nominal system from x_r on."""
        f = self.formulation.nominal
        return StepProblem(f, self.k, self.window.states[0], self.window, f.local_model(self.window, self.window))

    def on_reference(self) -> Plan | None:
        """Return the plan that stays on the reference, of cost 0, if it is one: the optimum wherever x ∈ x_r ⊕ Z."""
        f, window = self.formulation, self.window
        if not f.errors.contains(self.off) or not np.max(np.abs(self._defects)) <= _FOLLOWED:
            return None
        slack = min(self.nominal.slack.smallest, self._start_slack)
        if slack < -TOLERANCE:
            return None
        return Plan(
            k=self.k,
            input=f.admissible.pull_inside(window.inputs[0] + f.invariant.feedback @ self.off),
            cost=0.0,
            stage_cost=0.0,
            states=window.states,
            inputs=window.inputs,
            slack=slack,
            terminal_residual=0.0,
            status=Status.NO_ACTIVE_BOUND,
        )

    def without_bounds(self) -> Plan | None:
        """Return the optimum with no bound but x − z(0) ∈ Z, if it keeps them all.

        Its cost is a quadratic distance of z(0) from the cheapest start, and so x − z(0) is the point of Z that is
        nearest to what is left of x − x_r (`Nearest` says how nearly).
        """
        f, scales = self.formulation, self.formulation.nominal.scales
        if not f.start_cost.is_strict:
            return None
        cheapest = f.start_cost.cheapest(self._defects) * scales.states
        nearest = f.nearest(self.off - cheapest)
        if nearest is None:
            return None
        start = self.off - nearest
        model = self.nominal.model
        unforced = model.error_model.unforced_errors(start, model.defects) / scales.states
        plan = self.plan(start, model.without_bounds.input_errors(unforced) * scales.inputs, Status.NO_ACTIVE_BOUND)
        return plan if plan.slack >= -ROUNDING else None

    def with_active_bounds(self) -> Plan | None:
        """Return the optimum by an active-set method; None where there is no plan. Raises LinAlgError if that fails."""
        f = self.formulation
        if not f.start_cost.is_strict:
            raise np.linalg.LinAlgError("there is more than one optimum")
        start_slack = f.start_slack(self.window.states[0])
        found = f.bounded.solve(self.off, self._defects, start_slack, self.nominal.slack)
        if found is None:
            return None
        plan = self._scaled_plan(*found, Status.SOLVED)
        if plan.slack < -TOLERANCE:
            raise np.linalg.LinAlgError("the plan does not keep its bounds")
        return plan

    def solved(self) -> Plan | None:
        """Return the optimum by an interior-point method, if that finds it."""
        plan = self._solved(self.formulation.tracking, status=Status.SOLVED)
        return None if plan is None else _admissible(plan)

    def kept(self, inputs: Array) -> Plan | None:
        """Return the plan with these nominal inputs (N, m); None where it is none.

        Its nominal start is that from which they end on the reference: Aᴺ e(0) = −(what they do to e(N) alone).
        """
        model, v, n = self.nominal.model, inputs - self.window.inputs, len(self.off)
        forced = model.error_model.errors(np.zeros(n), v, model.defects)[-1]
        start, *_ = np.linalg.lstsq(model.error_model.free[-n:], -forced, rcond=None)
        if not self.formulation.errors.contains((1 - TOLERANCE) * (self.off - start)):  # as accurate as the solver is
            return None
        plan = self.plan(start, v, Status.KEPT)
        ends = replace(self.nominal, state=plan.states[0]).ends_on_reference(plan)
        return _admissible(plan) if ends else None

    @property
    def widened(self) -> Plan | Infeasible:
        """A plan that needs a widening below the tolerance, or how much is needed."""
        plan = self._solved(self.formulation.widening)
        if plan is None:
            raise ArithmeticError("the numbers are beyond the solver")
        if plan.slack >= -TOLERANCE:
            return plan
        f = self.formulation.nominal
        errors, v = plan.states[1:] - self.window.states[1:], plan.inputs - self.window.inputs
        quantity, ahead = self.nominal.slack.remaining(f.inequalities, errors, v).tightest
        constraint, closest = f.plant.given_constraints[quantity], self.closest
        return Infeasible(
            k=self.k,
            widening=-plan.slack,
            quantity=constraint.name,
            at_step=self.k + ahead,
            excess=-plan.slack * constraint.bounds.width,
            terminal_error=None if closest is None else closest.states[-1] - self.window.states[-1],
            fallback=(closest or plan).input,
            is_local=False,
        )

    @cached_property
    def closest(self) -> Plan | None:
        """The plan in the tightened sets that ends closest to the reference (in scales), and costs the least of those
        with that end; None where no plan is found."""
        nearest = self._solved(self.formulation.terminal_error, by=TOLERANCE)
        if nearest is None:
            return None
        end = nearest.states[-1] - self.window.states[-1]
        return self._solved(self.formulation.tracking, end, by=2 * TOLERANCE) or nearest

    def plan(self, start: Array, v: Array, status: Status) -> Plan:
        """Return the plan whose nominal start is x_r + `start`: its slack counts from there, its input is u."""
        f, z = self.formulation, self.window.states[0] + start
        plan = replace(self.nominal, state=z).plan(v, status)
        u = plan.inputs[0] + f.invariant.feedback @ (self.state - z)
        slack = min(plan.slack, float(np.min(f.start_slack(z), initial=np.inf)))
        return replace(plan, input=f.admissible.pull_inside(u), slack=slack)

    def _solved(
        self,
        program: TubeProgram,
        end: Array | float = 0.0,
        by: float = 0.0,
        status: Status = Status.WIDENED,
    ) -> Plan | None:
        """Return the plan that a program finds, with all bounds widened by a part of their widths."""
        scales = self.formulation.nominal.scales
        start_slack = self.formulation.start_slack(self.window.states[0]) + by
        missed = np.broadcast_to(end, self.off.shape) / scales.states
        model, slack = self.nominal.model.scaled, self.nominal.slack.widened(by)
        found = program.solve(model, self.off, self._defects, start_slack, slack, missed)
        return None if found is None else self._scaled_plan(*found, status)

    def _scaled_plan(self, start: Array, v: Array, status: Status) -> Plan:
        scales = self.formulation.nominal.scales
        return self.plan(start * scales.states, v * scales.inputs, status)

    @cached_property
    def _defects(self) -> Array:
        return np.asarray(self.nominal.model.defects / self.formulation.nominal.scales.states)

    @property
    def _start_slack(self) -> float:
        return float(np.min(self.formulation.start_slack(self.window.states[0]), initial=np.inf))


def _admissible(plan: Plan) -> Plan | None:
    return plan if plan.slack >= -TOLERANCE else None
