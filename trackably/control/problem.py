"""The optimal control problem of one step: its optimal plan, or how much wider sets would allow a plan."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from trackably.arrays import Array
from trackably.control.bounds import PlantInequalities, Scales, pull_inside
from trackably.control.error_model import ErrorModel
from trackably.control.programs import Program, StartSet, StepPrograms
from trackably.control.stepping import ROUNDING, Infeasible, Plan, Status
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Window


@dataclass(frozen=True, eq=False)
class Formulation:
    """The parts of the problem that all steps share, for a `horizon` N and weights Q (n, n), R (m, m).

    `input_set` bounds the input that is applied; it is not tightened, even if the sets of `plant` are. Each part is
    computed on first use.
    """

    plant: ConstrainedSystem
    horizon: int
    Q: Array
    R: Array
    input_set: Polytope

    @property
    def is_linear(self) -> bool:
        """Whether the same error model holds along every trajectory."""
        return isinstance(self.plant.system, LinearSystem)

    def linearise(self, window: Window, nominal: Window) -> tuple[StepPrograms, Array]:
        """Return the programs in the errors z from a reference, and the defects (N n,) of their model.

        `window` is the reference, and the system is linearised along the trajectory `nominal`: the model is exact on
        it, and exact to first order near it. Both are windows of N steps. Raises ArithmeticError if the system is
        undefined there.
        """
        programs = self._anywhere if self.is_linear else self.programs(nominal)
        defects = self.defects(nominal).ravel() - programs.model.dynamics @ self.scales.errors(nominal, window)
        if not np.all(np.isfinite(defects)):  # an entry of the model that is not finite makes a defect not finite, too
            raise ArithmeticError("a plan leads where the system is not defined: bound states and inputs more tightly")
        return programs, defects

    def defects(self, trajectory: Window) -> Array:
        """Return f(x(i), u(i)) − x(i+1), in the states' scales (N, n): how far a trajectory violates the dynamics."""
        successors = self.plant.system.successor(trajectory.states[:-1], trajectory.inputs)
        return (successors - trajectory.states[1:]) / self.scales.states

    def model(self, nominal: Window) -> ErrorModel:
        """Return the model of the errors e and v, divided by their scales, linearised along a trajectory."""
        return ErrorModel.along(self.plant.system, nominal, self.scales)

    def programs(self, nominal: Window) -> StepPrograms:
        """Return the programs with the error model along a trajectory."""
        scales, sets = self.scales, self.inequalities()
        rows = sets.states.in_widths(scales.states), sets.inputs.in_widths(scales.inputs)
        return StepPrograms(self.model(nominal), *scales.weights(self.Q, self.R), *rows, self.start)

    @cached_property
    def _anywhere(self) -> StepPrograms:
        """The programs of a linear system, the same along every trajectory."""
        n, m, N = len(self.Q), len(self.R), self.horizon
        return self.programs(Window(np.zeros((N + 1, n)), np.zeros((N, m))))

    @cached_property
    def scales(self) -> Scales:
        return Scales.of(self.plant, self.Q, self.R)

    def inequalities(self, k: int = 0) -> PlantInequalities:
        """Return the sets as inequalities; moving bounds (linear systems only) are evaluated at steps k, …, k + N."""
        times = self.plant.sampling_time * (k + np.arange(self.horizon + 1.0))
        return PlantInequalities.of(self.plant, times, self.start.first_bounded)

    @cached_property
    def start(self) -> StartSet:
        """The set of states from which plans may start, divided by their scales: the measured state only."""
        return StartSet.measured(len(self.Q))

    @cached_property
    def feedback(self) -> Array:
        """K (m, n) in u = v(0) + K (x − z(0)), for plans whose start z(0) differs from the measured state.

        It is zero here, because plans start from the measured state.
        """
        return np.zeros((len(self.R), len(self.Q)))


TOLERANCE = 1e-7
"""A step counts as feasible if it is feasible with every set widened by this part of its width.

When a reference touches a bound, plans have no slack, and the state differs from the last plan by rounding and by the
solver's accuracy. Without a tolerance, feasibility would be lost at such a step. A certified reference itself satisfies
its bounds without any tolerance.
"""

_ULPS = 64 * np.finfo(float).eps
"""A plan may miss the end of the reference by this part of the size of its states, because of rounding."""


@dataclass(frozen=True, eq=False)
class StepProblem:
    """The problem of step `k`: the measured `state` (n,), the reference's `window` ahead, and the model of errors.

    The model of errors is the linear one of the `programs`, with the `defects` (N n,) of its linearisation. Every
    method raises ArithmeticError if the numbers are beyond the solver or floating point.
    """

    formulation: Formulation
    k: int
    state: Array
    window: Window
    programs: StepPrograms
    defects: Array

    @classmethod
    def of(cls, formulation: Formulation, k: int, state: Array, window: Window) -> Self:
        """Return the problem of a step, linearised along the reference."""
        return cls(formulation, k, state, window, *formulation.linearise(window, window))

    def along(self, nominal: Window) -> Self:
        """Return the same problem, linearised along another trajectory."""
        programs, defects = self.formulation.linearise(self.window, nominal)
        return replace(self, programs=programs, defects=defects)

    @cached_property
    def optimum(self) -> Plan | None:
        """The optimal plan; None if there is no plan."""
        return self.without_bounds() or self._optimum(self.slack, Status.SOLVED) or self.within_tolerance()

    @property
    def answer(self) -> Plan | Infeasible:
        """The optimal plan, or the reason why there is none."""
        return self.optimum or self.infeasible

    @cached_property
    def off(self) -> Array:
        """The error x(k) − x_r(k) of the measured state, shape (n,)."""
        return np.asarray(self.state - self.window.states[0])

    @cached_property
    def slack(self) -> Array:
        """The slacks that the reference leaves for errors, one for each bound and step, relative to widths."""
        return self.formulation.inequalities(self.k).slack(self.window)

    def without_bounds(self) -> Plan | None:
        """Return the optimum without bounds, if it satisfies them."""
        plan = self.plan(self.programs.tracking.solve_equations(self._equations()), Status.NO_ACTIVE_BOUND)
        return plan if plan.slack >= -ROUNDING and self.ends_on_reference(plan) else None

    def within_tolerance(self) -> Plan | None:
        """Return the optimum with all sets widened by the tolerance; None if no plan exists in these sets.

        If there are plans, but the solver does not find the optimum, return `widest`.
        """
        if -self.widest.slack > TOLERANCE:
            return None
        return self._optimum(self.slack + TOLERANCE, Status.WIDENED) or self.widest

    @cached_property
    def widest(self) -> Plan:
        """The plan with the largest slack; if this is negative, the plan that needs the least widening of the sets.

        This program always has a solution. Raises ArithmeticError if the solver does not find it.
        """
        plan = self._solve(self.programs.widening, self.slack)
        if plan is None or not self.ends_on_reference(plan):
            raise ArithmeticError(
                "the solver fails on a program that has a solution; numbers of the plant, Q or R may differ too much "
                "in size: choose other units"
            )
        return plan

    @cached_property
    def infeasible(self) -> Infeasible:
        """The reason why there is no plan.

        It says by how much the sets would have to be widened for a plan, and how far from the reference a plan ends
        that satisfies the sets as they are.
        """
        f, closest, widest, tracking = self.formulation, self.closest, self.widest, self.programs.tracking
        fallback = closest or self._solve(tracking, self.slack + (TOLERANCE - widest.slack)) or widest
        used = self.programs.bounds @ f.scales.errors(widest.trajectory, self.window)
        quantity, steps_ahead = f.inequalities().tightest(self.slack - used, f.horizon)
        constraint = f.plant.given_constraints[quantity]
        return Infeasible(
            k=self.k,
            widening=-widest.slack,
            quantity=constraint.name,
            at_step=self.k + steps_ahead,
            excess=-widest.slack * constraint.bounds.width,
            terminal_error=None if closest is None else closest.states[-1] - self.window.states[-1],
            fallback=fallback.input,
            is_local=not f.is_linear,
        )

    @cached_property
    def closest(self) -> Plan | None:
        """The cheapest of all plans in the sets that end at the least distance from the reference.

        States are divided by their scales for this distance. None if no plan is found. The first program finds the
        nearest end, but its plan may be far from the reference before the end. The second program finds the plan of
        least cost with this end.
        """
        nearest = self._solve(self.programs.terminal_error, self.slack + TOLERANCE, None)
        if nearest is None:
            return None
        # Twice the tolerance: with once, a single plan may have this end, and the second program has no interior.
        return self._solve(self.programs.tracking, self.slack + 2 * TOLERANCE, self._missed(nearest)) or nearest

    def is_feasible(self, plan: Plan) -> bool:
        """Whether a plan ends on the reference, and its states and inputs are in the sets up to twice the tolerance."""
        return self.ends_on_reference(plan) and plan.slack >= -2 * TOLERANCE

    def ends_on_reference(self, plan: Plan) -> bool:
        """Whether a plan ends on the reference, up to the tolerance (relative to the scales) and rounding."""
        largest = np.max(np.abs(plan.states) / self.formulation.scales.states)
        return bool(np.max(np.abs(self._missed(plan))) <= TOLERANCE + _ULPS * largest)

    def _missed(self, plan: Plan) -> Array:
        """Return x(k+N) − x_r(k+N) of a plan (n,), divided by the scales of the states."""
        return np.asarray((plan.states[-1] - self.window.states[-1]) / self.formulation.scales.states)

    def plan_with(self, inputs: Array, status: Status, start: Array | None = None) -> Plan:
        """Return the plan with these inputs (N, m) from the state `start` (n,), by default the measured one."""
        states = np.vstack([self.state if start is None else start, self.window.states[1:]])
        return self.plan(self.formulation.scales.errors(Window(states, inputs), self.window), status)

    def plan(self, z: Array, status: Status) -> Plan:
        """Return the plan with the start e(0) and the inputs v of the errors z; its states are those of the model."""
        f, window, z = self.formulation, self.window, self.programs.model.predict(z, self.defects)
        e, v = f.scales.split(z)
        stage_costs = np.einsum("ia,ab,ib->i", e[:-1], f.Q, e[:-1]) + np.einsum("ia,ab,ib->i", v, f.R, v)
        if not (np.all(np.isfinite(e)) and np.all(np.isfinite(v)) and np.isfinite(np.sum(stage_costs))):
            raise ArithmeticError("a predicted state or input overflows in float64: choose other units")
        return Plan(
            k=self.k,
            input=pull_inside(
                f.input_set.at(self.k * f.plant.sampling_time),
                window.inputs[0] + v[0] + f.feedback @ (self.off - e[0]),
            ),
            cost=float(np.sum(stage_costs)),
            stage_cost=float(stage_costs[0]),
            states=window.states + e,
            inputs=window.inputs + v,
            slack=float(np.min(self.slack - self.programs.bounds @ z, initial=np.inf)),
            terminal_residual=float(np.max(np.abs(e[-1]))),
            status=status,
        )

    def _optimum(self, slack: Array, status: Status) -> Plan | None:
        """Return the optimum with bounds that leave the slacks `slack`, if the solver finds it."""
        plan = self._solve(self.programs.tracking, slack, status=status)
        return plan if plan is not None and self.is_feasible(plan) else None

    def _solve(
        self, program: Program, slack: Array, end: Array | float | None = 0.0, status: Status = Status.WIDENED
    ) -> Plan | None:
        """Return the plan that a program finds for the slacks `slack`; None if it finds none.

        The plan ends with the scaled error e(N) = `end` (n,). If `end` is None, e(N) is free.
        """
        start, equations = self.programs.start, self._equations(end)
        found = program.solve(np.concatenate([equations, np.ones(len(start.lower)), -start.lower, slack]))
        if found is None:
            return None
        z = found[: self.programs.model.dynamics.shape[1]]
        if not len(start.directions):
            z[: len(self.off)] = equations[: len(self.off)]  # e(0) as measured, without the solver's error
        return self.plan(z, status)

    def _equations(self, end: Array | float | None = 0.0) -> Array:
        """Return the right sides of a program's equations, e(N) = `end` (scaled) last; for None, e(N) is free."""
        start, scales = self.programs.start, self.formulation.scales.states
        fixed = () if end is None else (np.broadcast_to(end, scales.shape),)
        return np.concatenate([self.off / scales - start.centre, np.ones(len(start.sums)), -self.defects, *fixed])
