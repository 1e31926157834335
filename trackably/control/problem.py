"""The problem of one step: its optimal plan, or how much the sets would have to be widened for a plan."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from trackably.arrays import Array
from trackably.control.bounds import PlantInequalities, Scales, pull_inside
from trackably.control.error_model import ErrorModel, linearisation_defects
from trackably.control.programs import Program, StartSet, StepPrograms
from trackably.control.stepping import ROUNDING, Infeasible, Plan, Status
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Window


@dataclass(frozen=True, eq=False)
class LocalModel:
    """The error model near one trajectory, its defects d (N, n), and the scaled programs that use it."""

    error_model: ErrorModel
    programs: StepPrograms
    defects: Array


@dataclass(frozen=True, eq=False)
class Formulation:
    """The parts of the problem that all steps share, for a `horizon` N and weights Q (n, n), R (m, m).

    Each part is computed on first use.
    """

    plant: ConstrainedSystem
    horizon: int
    Q: Array
    R: Array

    @property
    def is_linear(self) -> bool:
        """Whether the same error model holds along every trajectory."""
        return isinstance(self.plant.system, LinearSystem)

    def local_model(self, window: Window, nominal: Window) -> LocalModel:
        """Return the model of the errors x − x_r and u − u_r near a trajectory, both as windows of N steps.

        `window` is the reference, and the system is linearised along the trajectory `nominal`. Raises ArithmeticError
        if the system is undefined there.
        """
        model, programs = self._anywhere if self.is_linear else self._along(nominal)
        defects = linearisation_defects(model, self.plant.system, window, nominal)
        if not all(np.all(np.isfinite(part)) for part in (model.A, model.B, defects)):
            raise ArithmeticError("a plan leads where the system is not defined")
        return LocalModel(model, programs, defects)

    @cached_property
    def scales(self) -> Scales:
        return Scales.of(self.plant, self.Q, self.R)

    @cached_property
    def inequalities(self) -> PlantInequalities:
        """The sets as inequalities; bounds that move are those of a horizon that begins at step 0."""
        return self._inequalities(0)

    def inequalities_from(self, k: int) -> PlantInequalities:
        """Return the sets as inequalities; bounds that move (linear systems only) are those at steps k, …, k + N."""
        return self._inequalities(k) if self.plant.moves else self.inequalities

    def _inequalities(self, k: int) -> PlantInequalities:
        times = self.plant.sampling_time * (k + np.arange(self.horizon + 1.0))
        return PlantInequalities.of(self.plant, times, self.start.first_bounded)

    @cached_property
    def start(self) -> StartSet:
        """The set of initial states of plans, scaled: only the measured state."""
        return StartSet.measured(len(self.Q))

    @cached_property
    def feedback(self) -> Array:
        """K (m, n) in u = v(0) + K (x − z(0)), for plans whose start z(0) differs from the measured state.

        It is zero here, because plans start from the measured state.
        """
        return np.zeros((len(self.R), len(self.Q)))

    @property
    def input_set(self) -> Polytope:
        """The set of the inputs that are applied."""
        return self.plant.input_set

    @cached_property
    def _anywhere(self) -> tuple[ErrorModel, StepPrograms]:
        """The model of a linear system, the same along every trajectory."""
        n, m, N = len(self.Q), len(self.R), self.horizon
        return self._along(Window(np.zeros((N + 1, n)), np.zeros((N, m))))

    def programs(self, model: ErrorModel) -> StepPrograms:
        """Return the programs along a model of the errors."""
        scales, X, U = self.scales, self.inequalities.states, self.inequalities.inputs
        rows = X.in_widths(scales.states), U.in_widths(scales.inputs)
        return StepPrograms(model.scaled(scales), *scales.weights(self.Q, self.R), *rows, self.start)

    def _along(self, nominal: Window) -> tuple[ErrorModel, StepPrograms]:
        model = ErrorModel.along(self.plant.system, nominal)
        return model, self.programs(model)


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

    Every method raises ArithmeticError if the numbers are beyond the solver or floating point.
    """

    formulation: Formulation
    k: int
    state: Array
    window: Window
    model: LocalModel

    @classmethod
    def of(cls, formulation: Formulation, k: int, state: Array, window: Window) -> Self:
        """Return the problem of a step, linearised along the reference."""
        return cls(formulation, k, state, window, formulation.local_model(window, window))

    def along(self, nominal: Window) -> Self:
        """Return the same problem, linearised along another trajectory."""
        return replace(self, model=self.formulation.local_model(self.window, nominal))

    @cached_property
    def optimum(self) -> Plan | None:
        """The optimal plan; None if there is no plan."""
        return self.without_bounds() or self.with_bounds() or self.within_tolerance()

    @cached_property
    def off(self) -> Array:
        """x(k) − x_r(k), shape (n,)."""
        return np.asarray(self.state - self.window.states[0])

    @cached_property
    def slack(self) -> Array:
        """The slacks that the reference leaves for errors, one for each bound and step, relative to widths."""
        return self.formulation.inequalities_from(self.k).slack(self.window)

    @property
    def free_start(self) -> Array | None:
        """The error e(0) (n,) at the start of the optimal plan if no bound is active; None if it is not known."""
        return self.off

    def without_bounds(self) -> Plan | None:
        """Return the optimum without bounds, if it satisfies them."""
        start, scales = self.free_start, self.formulation.scales
        if start is None:
            return None
        unforced = self.model.error_model.errors(start, np.zeros_like(self.window.inputs), self.model.defects)
        v = self.model.programs.gain @ (unforced / scales.states).ravel()
        v = v.reshape(self.window.inputs.shape) * scales.inputs
        plan = self.plan(v, Status.NO_ACTIVE_BOUND, start)
        return plan if plan.slack >= -ROUNDING else None

    def with_bounds(self) -> Plan | None:
        """Return the optimum with bounds, if the solver finds it."""
        return self._optimum(self.slack, Status.SOLVED)

    def within_tolerance(self) -> Plan | None:
        """Return the optimum with all sets widened by the tolerance; None if that is not enough."""
        if -self.widest.slack > TOLERANCE:
            return None
        return self._optimum(self.slack + TOLERANCE, Status.WIDENED) or self.widest

    @cached_property
    def widest(self) -> Plan:
        """The plan with the largest slack; if this is negative, the plan that needs the least widening of the sets.

        This program always has a solution. Raises ArithmeticError if the solver does not find it.
        """
        plan = self._solve(self.model.programs.widening, self.slack, 0.0)
        if plan is None or not self.ends_on_reference(plan):
            raise ArithmeticError(
                "the solver fails on a program that has a solution; numbers of the plant, Q or R may differ too much "
                "in size"
            )
        return plan

    @cached_property
    def infeasible(self) -> Infeasible:
        """The reason why there is no plan.

        It says by how much the sets would have to be widened for a plan, and how far from the reference a plan ends
        that satisfies the sets as they are.
        """
        f, closest, widest, tracking = self.formulation, self.closest, self.widest, self.model.programs.tracking
        fallback = closest or self._solve(tracking, self.slack + (TOLERANCE - widest.slack), 0.0) or widest
        errors, v = widest.states - self.window.states, widest.inputs - self.window.inputs
        quantity, steps_ahead = f.inequalities.tightest(self.slack - f.inequalities.used(errors, v), f.horizon)
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
        programs = self.model.programs
        nearest = self._solve(programs.terminal_error, self.slack + TOLERANCE, None)
        if nearest is None:
            return None
        # Twice the tolerance: with the same one, the second program has no interior if only one plan has this end.
        end = nearest.states[-1] - self.window.states[-1]
        return self._solve(programs.tracking, self.slack + 2 * TOLERANCE, end) or nearest

    def is_feasible(self, plan: Plan) -> bool:
        """Whether a plan ends on the reference, and its states and inputs are in the sets up to twice the tolerance."""
        return self.ends_on_reference(plan) and plan.slack >= -2 * TOLERANCE

    def ends_on_reference(self, plan: Plan) -> bool:
        """Whether a plan ends on the reference, up to the tolerance (relative to the scales) and rounding."""
        scales = self.formulation.scales.states
        missed = np.max(np.abs(plan.states[-1] - self.window.states[-1]) / scales)
        return bool(missed <= TOLERANCE + _ULPS * np.max(np.abs(plan.states) / scales))

    def plan(self, v: Array, status: Status, start: Array | None = None) -> Plan:
        """Return the plan with input errors v (N, m) from e(0) = `start` (n,), by default the measured error."""
        f, start = self.formulation, self.off if start is None else start
        e = np.vstack([start, self.model.error_model.errors(start, v, self.model.defects)])
        stage_costs = np.einsum("ia,ab,ib->i", e[:-1], f.Q, e[:-1]) + np.einsum("ia,ab,ib->i", v, f.R, v)
        if not (np.all(np.isfinite(e)) and np.all(np.isfinite(v)) and np.isfinite(np.sum(stage_costs))):
            raise ArithmeticError("a predicted state or input overflows in float64")
        return Plan(
            k=self.k,
            input=pull_inside(
                f.input_set.at(self.k * f.plant.sampling_time),
                self.window.inputs[0] + v[0] + f.feedback @ (self.off - start),
            ),
            cost=float(np.sum(stage_costs)),
            stage_cost=float(stage_costs[0]),
            states=self.window.states + e,
            inputs=self.window.inputs + v,
            slack=float(np.min(self.slack - f.inequalities.used(e, v), initial=np.inf)),
            terminal_residual=float(np.max(np.abs(e[-1]))),
            status=status,
        )

    def _optimum(self, slack: Array, status: Status) -> Plan | None:
        plan = self._solve(self.model.programs.tracking, slack, 0.0, status)
        return plan if plan is not None and self.is_feasible(plan) else None

    def _solve(
        self, program: Program, slack: Array, end: Array | float | None, status: Status = Status.WIDENED
    ) -> Plan | None:
        """Return the plan that a program finds for the slacks `slack`; None if it finds none.

        The plan ends with e(N) = `end` (n,). If `end` is None, e(N) is free.
        """
        scales, programs = self.formulation.scales, self.model.programs
        x, start = scales.states, programs.start
        fixed = () if end is None else (np.broadcast_to(end, x.shape) / x,)
        limits = [self.off / x - start.centre, np.ones(len(start.sums)), -(self.model.defects / x).ravel(), *fixed]
        limits += [np.ones(len(start.lower)), -start.lower, slack]
        found = program.solve(np.concatenate(limits))
        if found is None:
            return None
        e, v = programs.split(found)
        return self.plan(v * scales.inputs, status, e[0] * x if len(start.directions) else self.off)
