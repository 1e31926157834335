"""The optimal control problem of one step: its optimal plan, or how much wider sets would allow a plan."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy

from trackably.arrays import Array
from trackably.control.bounds import Scales, pull_inside
from trackably.control.error_set import ErrorSet
from trackably.control.programs import Program, StepPrograms
from trackably.control.stepping import ROUNDING, Infeasible, Plan, Status
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope, rows_in_widths, slacks
from trackably.systems.reference import Window

_TIE = 1e-6
"""Slacks count as equal if they exceed the smallest one, s, by at most this part of 1 + |s|."""


@dataclass(frozen=True, eq=False)
class Formulation:
    """The parts of the problem that all steps share, for a `horizon` N and weights Q (n, n), R (m, m).

    Plans start from z(0) = x − s for an s in the `start_set`, where x is the measured state. The input that is applied
    is u = v(0) + K (x − z(0)) with the `feedback` K (m, n) and the plan's first input v(0). It is bounded by
    `input_set`, which is not tightened, even if the sets of `plant` are.

    A trajectory is described by its scaled errors z: (x − x_r) / s_x at all steps, then (u − u_r) / s_u, with the
    `scales` s_x and s_u. x_r and u_r are those of the reference's window. z has (N + 1) n + N m entries. Bounds are
    imposed on all inputs, and on the states x(`first_bounded`), …, x(N). The slacks of a trajectory are relative to the
    widths, and stand in one vector: those of the states step by step, then those of the inputs.

    Each part is computed on first use.
    """

    plant: ConstrainedSystem
    horizon: int
    Q: Array
    R: Array
    input_set: Polytope
    start_set: ErrorSet
    feedback: Array
    first_bounded: int

    @property
    def is_linear(self) -> bool:
        """Whether the system is linear, so that its linearisation is the same along every trajectory."""
        return isinstance(self.plant.system, LinearSystem)

    @property
    def starts_measured(self) -> bool:
        """Whether plans can start from the measured state only."""
        return not len(self.start_set.directions)

    def defects(self, trajectory: Window) -> Array:
        """Return f(x(i), u(i)) − x(i+1), in the states' scales (N, n): how far a trajectory violates the dynamics."""
        successors = self.plant.system.successor(trajectory.states[:-1], trajectory.inputs)
        return (successors - trajectory.states[1:]) / self.scales.states

    def programs(self, nominal: Window) -> StepPrograms:
        """Return the convex programs of a step, with the system linearised along the trajectory `nominal`."""
        (A, B), (x, u, _) = self.plant.system.slopes(nominal.states[:-1], nominal.inputs), self.scales
        start = replace(self.start_set, centre=self.start_set.centre / x, directions=self.start_set.directions / x)
        return StepPrograms(A * x / x[:, None], B * u / x[:, None], self.weights, self.bounds, start)

    @cached_property
    def anywhere(self) -> StepPrograms:
        """The programs of a linear system, the same along every trajectory."""
        n, m, N = len(self.Q), len(self.R), self.horizon
        return self.programs(Window(np.zeros((N + 1, n)), np.zeros((N, m))))

    @cached_property
    def scales(self) -> Scales:
        """The units s_x of the states, s_u of the inputs, and that of the cost."""
        return Scales.of(self.plant, self.Q, self.R)

    @cached_property
    def units(self) -> Array:
        """The unit of each entry of the scaled errors z."""
        x, u, _ = self.scales
        return np.concatenate([np.tile(x, self.horizon + 1), np.tile(u, self.horizon)])

    def errors(self, trajectory: Window, window: Window) -> Array:
        """Return the scaled errors z of a trajectory from the reference's `window`."""
        x, u = (a - b for a, b in zip(trajectory, window, strict=True))
        return np.concatenate([x.ravel(), u.ravel()]) / self.units

    def split(self, z: Array) -> Window:
        """Return x − x_r (N + 1, n) and u − u_r (N, m) from the scaled errors z."""
        e, v = np.split(z * self.units, [(self.horizon + 1) * len(self.Q)])
        return Window(e.reshape(-1, len(self.Q)), v.reshape(-1, len(self.R)))

    @cached_property
    def weights(self) -> Array:
        """The matrix M for which zᵀ M z is the cost of scaled errors z, in the cost's unit (`scales`)."""
        N, units = self.horizon, self.units
        weights = scipy.linalg.block_diag(np.kron(np.diag(np.arange(N + 1) < N), self.Q), np.kron(np.eye(N), self.R))
        return weights * units[:, None] * units / self.scales.cost

    @cached_property
    def bounds(self) -> Array:
        """The matrix that maps scaled errors z to the amounts by which they lower the reference's slacks."""
        N, (x, u, _) = self.horizon, self.scales
        of_states = np.kron(np.eye(N + 1)[self.first_bounded :], rows_in_widths(self.plant.state_set, x))
        return scipy.linalg.block_diag(of_states, np.kron(np.eye(N), rows_in_widths(self.plant.input_set, u)))

    def tightest(self, slack: Array) -> tuple[int, int]:
        """Return how many steps ahead the smallest of a trajectory's slacks is, and the index of its row.

        The index counts the rows of the state set, then those of the input set. Of equal slacks the earliest counts.
        """
        r, s, N = len(self.plant.state_set.rows), len(self.plant.input_set.rows), self.horizon
        of_steps = [(range(r), i) for i in range(self.first_bounded, N + 1)] + [(range(r, r + s), i) for i in range(N)]
        places = [(i, quantity) for rows, i in of_steps for quantity in (*rows, *rows)]  # upper bounds, then lower ones
        largest = np.min(slack) + _TIE * (1 + abs(np.min(slack)))
        return min(place for place, of in zip(places, slack, strict=True) if of <= largest)


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

    The system is linearised along the trajectory `nominal`, a window of N steps: the model of errors is exact on it,
    and exact to first order near it. Every method raises ArithmeticError if the numbers are beyond the solver or
    floating point.
    """

    formulation: Formulation
    k: int
    state: Array
    window: Window
    nominal: Window

    @cached_property
    def programs(self) -> StepPrograms:
        """The convex programs of this step, whose variables are the scaled errors from the reference."""
        return self.formulation.anywhere if self.formulation.is_linear else self.formulation.programs(self.nominal)

    @cached_property
    def defects(self) -> Array:
        """The terms d (N n,) in the model e(i+1) = A_i e(i) + B_i v(i) + d_i of scaled errors, step by step.

        Raises ArithmeticError if the system is undefined along `nominal`.
        """
        f = self.formulation
        found = f.defects(self.nominal).ravel() - self.programs.dynamics @ f.errors(self.nominal, self.window)
        if not np.all(np.isfinite(found)):  # an entry of the model that is not finite makes a defect not finite, too
            raise ArithmeticError("a plan leads where the system is not defined: bound states and inputs more tightly")
        return np.asarray(found)

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
        """The slacks of the reference: its distances to all bounds, relative to their widths; negative if violated.

        Bounds that move in time (of linear systems only) are evaluated at the steps k, …, k + N.
        """
        plant, first = self.formulation.plant, self.formulation.first_bounded
        times = plant.sampling_time * (self.k + np.arange(self.formulation.horizon + 1.0))
        of_states = slacks(plant.state_set, self.window.states, times)[first:]
        return np.append(of_states, slacks(plant.input_set, self.window.inputs, times[:-1]))

    def without_bounds(self) -> Plan | None:
        """Return the plan that is optimal without bounds; None if it violates one.

        If plans may start off the measured state, it is the reference itself, as long as the state is in the tube
        around it; None outside of the tube. So most steps in the tube need no quadratic program.
        """
        f, status = self.formulation, Status.NO_ACTIVE_BOUND
        if f.starts_measured:
            plan = self.plan(self.programs.tracking.solve_equations(self._equations()), status)
        elif f.start_set.contains(self.off):
            plan = self.plan_with(self.window.inputs, status, self.window.states[0])
        else:
            return None
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
        used = self.programs.bounds @ f.errors(widest.trajectory, self.window)
        steps_ahead, quantity = f.tightest(self.slack - used)
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
        return self.plan(self.formulation.errors(Window(states, inputs), self.window), status)

    def plan(self, z: Array, status: Status) -> Plan:
        """Return the plan that the model predicts for the first error e(0) and the inputs v in the scaled errors z.

        The states in z after e(0) are not used. ArithmeticError: a predicted state or input overflows.
        """
        f, window, z = self.formulation, self.window, self.programs.predict(z, self.defects)
        e, v = f.split(z)
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
        """Return the plan of least cost under the bounds with the slacks `slack`; None if the solver finds none."""
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
        z = found[: self.programs.dynamics.shape[1]]
        if self.formulation.starts_measured:
            z[: len(self.off)] = equations[: len(self.off)]  # e(0) as measured, without the solver's error
        return self.plan(z, status)

    def _equations(self, end: Array | float | None = 0.0) -> Array:
        """Return the right sides of a program's equations, e(N) = `end` (scaled) last; for None, e(N) is free."""
        start, scales = self.programs.start, self.formulation.scales.states
        fixed = () if end is None else (np.broadcast_to(end, scales.shape),)
        return np.concatenate([self.off / scales - start.centre, np.ones(len(start.sums)), -self.defects, *fixed])
