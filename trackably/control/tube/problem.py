"""The problem of one step of a tube controller: its optimal plan, or how far the tightened sets are from one."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from trackably.arrays import Array
from trackably.control.step.problem import TOLERANCE, StepProblem
from trackably.control.step.result import ROUNDING, Infeasible, Plan, Status
from trackably.control.tube.formulation import TubeFormulation
from trackably.control.tube.program import TubeProgram
from trackably.systems.reference import Window

_FOLLOWED = 1e-12
"""Of the scales: a plan that would leave the reference by less is the reference."""


_PARTS = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Of the way from the reference to the measured state, in directions in which the start of a kept plan is free."""


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

        Most steps need no program: inside of the tube the reference is the plan, and off the tube the one from the
        start of least cost in x ⊖ Z will do, if no bound is active then.
        """
        try:
            return self.without_bounds() or self.with_active_bounds()
        except np.linalg.LinAlgError:  # beyond its numbers
            return self.solved()

    @cached_property
    def off(self) -> Array:
        """x − x_r, shape (n,)."""
        return np.asarray(self.state - self.window.states[0])

    @cached_property
    def nominal(self) -> StepProblem:
        """The problem of the nominal system from x_r on."""
        f, window = self.formulation.nominal, self.window
        return StepProblem(f, self.k, window.states[0], window, f.local_model(window, window))

    def without_bounds(self) -> Plan | None:
        """Return the optimum with no bound but x − z(0) ∈ Z, if it keeps them all: the reference for x ∈ x_r ⊕ Z."""
        start = self._free_start
        if start is None:
            return None
        model, scales = self.nominal.model, self.formulation.nominal.scales
        unforced = model.error_model.unforced_errors(start, model.defects) / scales.states
        if np.abs(unforced).max() <= _FOLLOWED:
            return self._reference
        plan = self.plan(start, model.without_bounds.input_errors(unforced) * scales.inputs, Status.NO_ACTIVE_BOUND)
        return plan if plan.slack >= -ROUNDING else None

    @property
    def _free_start(self) -> Array | None:
        """The z(0) − x_r of least cost in x ⊖ Z where no bound is active; None where it is not found, or not unique.

        Its cost is a quadratic distance from the cheapest start of all, and so x − z(0) is the point of Z that is
        nearest to x less that start (`Nearest` says how nearly).
        """
        f = self.formulation
        if not f.start_cost.is_strict:
            return np.zeros(len(self.off)) if f.errors.contains(self.off) else None
        free = self.off - f.start_cost.cheapest(self._defects) * f.nominal.scales.states
        nearest = f.nearest(free)
        return None if nearest is None else self.off - nearest

    @property
    def _reference(self) -> Plan | None:
        """The plan that stays on the reference, of cost 0; None where that breaks a bound."""
        f, window = self.formulation, self.window
        slack = min(self.nominal.slack.smallest, float(np.min(f.start_slack(window.states[0]), initial=np.inf)))
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

        Its nominal start is one from which they end on the reference (`_starts`). Where several are tried, the plan may
        cost more than the one that it comes from.
        """
        v = inputs - self.window.inputs
        for start in self._starts(v):
            if self.formulation.errors.contains((1 - TOLERANCE) * (self.off - start)):  # as accurate as the solver is
                plan = self.plan(start, v, Status.KEPT)
                if self.nominal.ends_on_reference(plan) and _admissible(plan):
                    return plan
        return None

    def _starts(self, v: Array) -> Iterator[Array]:
        """Yield starts e(0) (n,) from which input errors v (N, m) end on the reference: Aᴺ e(0) = −(what v does alone).

        The first one solves this as well as float64 can. Where Aᴺ nearly forgets a direction, what it finds there is
        rounding. Such a direction does not count at the end, and the start is free in it: the others lie on the way
        from the reference to the measured state.
        """
        model, n, scales = self.nominal.model, len(self.off), self.formulation.nominal.scales.states
        missed = model.error_model.errors(np.zeros(n), v, model.defects)[-1] / scales
        left, sizes, right = np.linalg.svd(model.error_model.free[-n:] * scales / scales[:, None])
        for least in (n * np.finfo(float).eps * sizes[0], TOLERANCE):
            counts = sizes > least
            start = -right[counts].T @ (left[:, counts].T @ missed / sizes[counts])
            free = right[~counts].T @ (right[~counts] @ (self.off / scales))
            yield from ((start + part * free) * scales for part in (_PARTS if np.any(~counts) else _PARTS[:1]))

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
        u = f.admissible.pull_inside(self.window.inputs[0] + v[0] + f.invariant.feedback @ (self.state - z))
        problem = StepProblem(f.nominal, self.k, z, self.window, self.nominal.model)
        return problem.applying(u, v, status, float(f.start_slack(z).min(initial=np.inf)))

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


def _admissible(plan: Plan) -> Plan | None:
    return plan if plan.slack >= -TOLERANCE else None
