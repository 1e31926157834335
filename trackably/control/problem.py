"""The problem of one step: its optimal plan, or how far the sets are from one."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from trackably.arrays import Array
from trackably.control.bounds import AdmissiblePoints, PlantInequalities, Scales, Slack
from trackably.control.error_model import ErrorModel, LinearQuadratic, linearisation_defects, reference_defects
from trackably.control.programs import CompiledProgram, ElasticProgram, MeasuredStart, StepPrograms
from trackably.control.stepping import ROUNDING, Infeasible, Plan, Status
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.reference import Window


@dataclass(frozen=True, eq=False)
class LocalModel:
    """The error model near one trajectory, its optimum without bounds (in scales), and the defects d (N, n)."""

    error_model: ErrorModel
    without_bounds: LinearQuadratic
    defects: Array

    @property
    def scaled(self) -> ErrorModel:
        """The model of the errors in scales."""
        return self.without_bounds.model


@dataclass(frozen=True, eq=False)
class Formulation:
    """The programs of a plant for a `horizon` N and weights Q (n, n) and R (m, m), each built when first used."""

    plant: ConstrainedSystem
    horizon: int
    Q: Array
    R: Array

    @property
    def is_linear(self) -> bool:
        """Whether one error model holds along every trajectory."""
        return isinstance(self.plant.system, LinearSystem)

    def local_model(self, window: Window, nominal: Window) -> LocalModel:
        """Return the model of the errors from a reference's `window`, linearised along the `nominal` trajectory."""
        if self.is_linear:
            defects = reference_defects(self.plant.system, window)
            return LocalModel(self._model, self.linear_optimum, defects)
        model = ErrorModel.along(self.plant.system, nominal)
        defects = linearisation_defects(model, self.plant.system, window, nominal)
        return LocalModel(model, self._without_bounds(model), defects)

    @cached_property
    def scales(self) -> Scales:
        return Scales.of(self.plant, self.Q, self.R)

    @cached_property
    def inequalities(self) -> PlantInequalities:
        return PlantInequalities.of(self.plant)

    @cached_property
    def programs(self) -> StepPrograms:
        return StepPrograms(self.plant, self.horizon, self.scales, self.scaled_weights, MeasuredStart(self.scales))

    @cached_property
    def elastic(self) -> ElasticProgram:
        return ElasticProgram(self.scales, self.inequalities, self.horizon, *self.scaled_weights)

    @cached_property
    def scaled_weights(self) -> tuple[Array, Array]:
        """Q and R of errors in scales, for a cost in its scale."""
        return self.scales.weights(self.Q, self.R)

    @cached_property
    def admissible(self) -> AdmissiblePoints:
        return AdmissiblePoints(self.plant.input_set)

    @cached_property
    def admissible_states(self) -> AdmissiblePoints:
        return AdmissiblePoints(self.plant.state_set)

    @cached_property
    def _model(self) -> ErrorModel:
        n, m, N = len(self.Q), len(self.R), self.horizon
        return ErrorModel.along(self.plant.system, Window(np.zeros((N + 1, n)), np.zeros((N, m))))

    @cached_property
    def linear_optimum(self) -> LinearQuadratic:
        """The optimum without bounds of a linear system, the same along every trajectory."""
        return self._without_bounds(self._model)

    def _without_bounds(self, model: ErrorModel) -> LinearQuadratic:
        return LinearQuadratic(model.scaled(self.scales), *self.scaled_weights)


TOLERANCE = 1e-7
"""A step counts as feasible if it is feasible with every set widened by this part of its width.

Where a reference touches a bound, plans have no slack, and a state that has followed the last plan differs from it by
rounding and by the solver's accuracy: without a tolerance feasibility would be lost at such a step. A certified
reference itself keeps its bounds without any tolerance.
"""

_ULPS = 64 * np.finfo(float).eps
"""States far from zero are known only up to their rounding: this part of their size."""


@dataclass(frozen=True, eq=False)
class StepProblem:
    """The problem of step `k`: the system's `state` (n,), the reference's `window` ahead, and the model of errors.

    Every result raises ArithmeticError where the numbers are beyond the solver or floating point.
    """

    formulation: Formulation
    k: int
    state: Array
    window: Window
    model: LocalModel

    @cached_property
    def optimum(self) -> Plan | None:
        """The optimal plan; None where there is no plan."""
        return self.without_bounds() or self.solved() or self.widened()

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
        scales = self.formulation.scales
        unforced = self.model.error_model.unforced_errors(self.initial_error, self.model.defects)
        v = self.model.without_bounds.input_errors(unforced / scales.states) * scales.inputs
        plan = self.plan(v, Status.NO_ACTIVE_BOUND)
        return plan if plan.slack >= -ROUNDING else None

    def solved(self) -> Plan | None:
        """Return the optimum with bounds, if the solver finds it."""
        return self._optimum(self.slack, Status.SOLVED)

    def widened(self) -> Plan | None:
        """Return the optimum with all sets widened by the tolerance; None where that is not enough."""
        if -self.widest.slack > TOLERANCE:
            return None
        return self._optimum(self.slack.widened(TOLERANCE), Status.WIDENED) or self.widest

    @cached_property
    def widest(self) -> Plan:
        """The plan with the largest slack; where that is negative, the one that needs the least widening of the sets.

        This program always has a solution. Raises ArithmeticError where the solver does not find it.
        """
        v = self._solve(self.formulation.programs.widening, self.slack)
        plan = None if v is None else self.plan(v, Status.WIDENED)
        if plan is None or not self.ends_on_reference(plan):
            raise ArithmeticError("the numbers are beyond the solver")
        return plan

    @cached_property
    def infeasible(self) -> Infeasible:
        """How much widening a plan needs, and how close one comes to the reference without it."""
        fallback = self.closest or self._tracking(self.slack.widened(TOLERANCE - self.widest.slack)) or self.widest
        return self.explain(self.widest, self.closest, fallback)

    def explain(self, widest: Plan, closest: Plan | None, fallback: Plan) -> Infeasible:
        """Return why there is no plan, where `widest` is the one that needs the least widening of the sets."""
        f = self.formulation
        errors, v = widest.states[1:] - self.window.states[1:], widest.inputs - self.window.inputs
        quantity, steps_ahead = self.slack.remaining(f.inequalities, errors, v).tightest
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
        """The plan that keeps the sets, ends as close to the reference as any does (in scales), and among those that
        end there costs the least; None where no plan is found.

        The end comes first: without the second minimum, any plan with that end would do, however far it leads from the
        reference on the way.
        """
        v = self._solve(self.formulation.programs.terminal_error, self.slack.widened(TOLERANCE))
        if v is None:
            return None
        nearest = self.plan(v, Status.WIDENED)
        # Where no other plan ends there, the first tolerance leaves the second program without an interior.
        end = nearest.states[-1] - self.window.states[-1]
        return self._tracking(self.slack.widened(2 * TOLERANCE), end) or nearest

    def is_feasible(self, plan: Plan) -> bool:
        """Whether a plan ends on the reference and keeps the sets, up to twice the tolerance."""
        return self.ends_on_reference(plan) and plan.slack >= -2 * TOLERANCE

    def ends_on_reference(self, plan: Plan) -> bool:
        """Whether a plan ends on the reference, up to the tolerance as a part of the scales, and up to rounding."""
        scales = self.formulation.scales.states
        missed = np.max(np.abs(plan.states[-1] - self.window.states[-1]) / scales)
        return bool(missed <= TOLERANCE + _ULPS * np.max(np.abs(plan.states) / scales))

    def plan(self, v: Array, status: Status) -> Plan:
        """Return the plan with input errors v (N, m)."""
        return self.applying(self.formulation.admissible.pull_inside(self.window.inputs[0] + v[0]), v, status)

    def applying(self, u: Array, v: Array, status: Status, slack: float = np.inf) -> Plan:
        """Return the plan with input errors v (N, m), of which u (m,) is applied; `slack` is that of e(0), if any."""
        f = self.formulation
        errors = self.model.error_model.errors(self.initial_error, v, self.model.defects)
        e = np.vstack([self.initial_error, errors])
        stage_costs = np.einsum("ia,ab,ib->i", e[:-1], f.Q, e[:-1]) + np.einsum("ia,ab,ib->i", v, f.R, v)
        if not (np.all(np.isfinite(e)) and np.all(np.isfinite(v)) and np.isfinite(np.sum(stage_costs))):
            raise ArithmeticError("a prediction overflows")
        return Plan(
            k=self.k,
            input=u,
            cost=float(np.sum(stage_costs)),
            stage_cost=float(stage_costs[0]),
            states=self.window.states + e,
            inputs=self.window.inputs + v,
            slack=min(slack, self.slack.remaining(f.inequalities, errors, v).smallest),
            terminal_residual=float(np.max(np.abs(errors[-1]))),
            status=status,
        )

    def _optimum(self, slack: Slack, status: Status) -> Plan | None:
        plan = self._tracking(slack, status=status)
        return plan if plan is not None and self.is_feasible(plan) else None

    def _tracking(self, slack: Slack, end: Array | float = 0.0, status: Status = Status.WIDENED) -> Plan | None:
        """Return the plan of least cost with e(N) = `end` (n,), by default zero; None where none is found."""
        v = self._solve(self.formulation.programs.tracking, slack, end)
        return None if v is None else self.plan(v, status)

    def _solve(self, program: CompiledProgram, slack: Slack, end: Array | float = 0.0) -> Array | None:
        """Return the v (N, m) that a program finds."""
        f, model = self.formulation, self.model
        start_slack = f.inequalities.states.slack(self.window.states[0])
        found = f.programs.solve(program, model.scaled, self.initial_error, model.defects, slack, start_slack, end)
        return None if found is None else found[1]
