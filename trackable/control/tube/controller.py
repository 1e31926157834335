"""Tube model predictive control that tracks a reference under disturbances."""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from trackable.arguments import instance, numbers, whole
from trackable.arrays import Array, ArrayLike
from trackable.control.controller import Controller
from trackable.control.references import TrackedReference
from trackable.control.step.admissible import AdmissiblePoints
from trackable.control.step.problem import TOLERANCE, StepProblem
from trackable.control.step.result import Infeasible, Plan, Status, StepResult, Unsolved
from trackable.control.step.slack import Slack
from trackable.control.tube.error_set import ErrorSet
from trackable.control.tube.program import TubeProgram
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.disturbance.invariant import InvariantSet
from trackable.systems.disturbance.tightening import Tightening
from trackable.systems.reference import Window


@dataclass(frozen=True, eq=False)
class TubeController:
    """min Σ_(i<N) ‖z(i) − x_r(k+i)‖²_Q + ‖v(i) − u_r(k+i)‖²_R with x ∈ z(0) ⊕ Z, z(N) = x_r(k+N) and tightened bounds.

    The nominal z(i+1) = A z(i) + B v(i) + c keeps the sets of `tightening.plant`, z(0) is free in x ⊖ Z, and the input
    applied is u = v(0) + K (x − z(0)). As long as disturbances are in W (Mayne, Seron, Raković 2005: Robust model
    predictive control of constrained linear systems with bounded disturbances, Automatica 41):

    - States and inputs keep the given bounds, as x ∈ z(0) ⊕ Z.
    - Feasibility is never lost on a robust reference: the plan, shifted by a step and continued with the reference's
      own input, is a plan for the next state, because x⁺ − z(1) = (A + B K) (x − z(0)) + w ∈ Z.
    - So V(k+1) ≤ V(k) − ℓ(k), and the nominal state tends to the reference: x is led into x_r ⊕ Z, where V = 0.

    Raises ValueError and TypeError as `Controller`, and where nothing is disturbed.
    """

    tightening: Tightening
    horizon: int
    Q: Array
    R: Array

    if TYPE_CHECKING:  # arrays are made of what is given

        def __init__(self, tightening: Tightening, horizon: int, Q: ArrayLike, R: ArrayLike) -> None: ...

    def __post_init__(self) -> None:
        instance(
            "tube: tightening", self.tightening, Tightening, "the tightening of a reference, or tightening(plant, W)"
        )
        nominal = Controller(self.tightening.plant, self.horizon, self.Q, self.R)
        for name in ("horizon", "Q", "R"):
            object.__setattr__(self, name, getattr(nominal, name))
        _ = self.errors  # found now, to raise its error

    @property
    def plant(self) -> ConstrainedSystem:
        """The system with the sets that are given: those that states and inputs keep."""
        return self.tightening.given

    @cached_property
    def nominal(self) -> Controller:
        """The controller of the nominal system, with the tightened sets."""
        return Controller(self.tightening.plant, self.horizon, self.Q, self.R)

    @cached_property
    def invariant(self) -> InvariantSet:
        """The invariant set Z of the error, with the feedback K."""
        if self.tightening.invariant is None:
            raise ValueError("tube: a disturbance set is needed; without one, Controller tracks the reference")
        return self.tightening.invariant

    @cached_property
    def errors(self) -> ErrorSet:
        """The same set in float64."""
        return ErrorSet(self.invariant)

    def step(self, k: int, state: Array, reference: TrackedReference, initial_guess: Array | None = None) -> StepResult:
        """Return the optimal plan at step `k` from the measured `state` (n,), or why there is none.

        The `states` and `inputs` of a `Plan` are nominal, and so are its cost and slack; its `input` is the one to
        apply, inside the given input set. `Infeasible` tells by how much the tightened sets would have to be widened,
        and how close a plan comes to the reference that keeps them; its fallback begins that plan.

        The optimum needs no `initial_guess` (N, m). Where the solver fails, the plan with these nominal inputs is taken
        if it is one, with the status `KEPT`. On a robust reference the last plan, shifted by a step (`shifted_inputs`),
        is one; its start is found again where Aᴺ can be inverted in float64. Raises ValueError as `Controller.step`.
        """
        k, state = whole("controller: k", k), numbers("controller: state", state)
        if state.shape != (n := len(self.Q),) or not np.all(np.isfinite(state)):
            raise ValueError(f"controller: a state is {n} finite numbers, got {state.tolist()} at step {k}")
        if initial_guess is not None:
            initial_guess = numbers("controller: initial_guess", initial_guess)
            if initial_guess.shape != (shape := (self.horizon, len(self.R))):
                raise ValueError(f"controller: initial_guess must have shape {shape}, got {initial_guess.shape}")
        try:
            with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # what is not finite is found later
                window = reference.window(k, self.horizon)
                if not all(np.all(np.isfinite(values)) for values in window):
                    raise ArithmeticError("the reference is not defined")
                return self._solved(k, state, window, initial_guess)
        except (ArithmeticError, np.linalg.LinAlgError) as error:
            return Unsolved(k, str(error), self._admissible.first_finite(()))

    def _solved(self, k: int, state: Array, window: Window, guess: Array | None) -> Plan | Infeasible:
        off = state - window.states[0]
        if self.errors.contains(off) and (plan := self._on_reference(k, state, window)):
            return plan
        problem = self._problem(k, window.states[0], window)
        found = self._optimum(self._tracking, problem, off)
        solved = None if found is None else self._plan(problem, state, *found, Status.SOLVED)
        if solved is not None and solved.slack >= -TOLERANCE:
            return solved
        kept = None if guess is None else self._kept(problem, state, off, guess)
        return kept or self._widened(problem, state, off)

    def _kept(self, problem: StepProblem, state: Array, off: Array, inputs: Array) -> Plan | None:
        """Return the plan with these nominal inputs (N, m); None where it is none.

        Its nominal start is that from which they end on the reference: Aᴺ e(0) = −(what they do to e(N) alone).
        """
        model, v = problem.model, inputs - problem.window.inputs
        n = len(off)
        forced = model.error_model.errors(np.zeros(n), v, model.defects)[-1]
        start, *_ = np.linalg.lstsq(model.error_model.free[-n:], -forced, rcond=None)
        if not self.errors.contains((1 - TOLERANCE) * (off - start)):  # as accurate as the solver is
            return None
        plan = self._plan(problem, state, start, v, Status.KEPT)
        ends = self._problem(problem.k, plan.states[0], problem.window).ends_on_reference(plan)
        return plan if ends and plan.slack >= -TOLERANCE else None

    @cached_property
    def _admissible(self) -> AdmissiblePoints:
        return AdmissiblePoints(self.plant.input_set)

    @cached_property
    def _tracking(self) -> TubeProgram:
        f = self.nominal.formulation
        return TubeProgram.tracking(f.plant, self.horizon, f.scales, self.Q, self.R, self.errors)

    @cached_property
    def _widening(self) -> TubeProgram:
        f = self.nominal.formulation
        return TubeProgram.widening(f.plant, self.horizon, f.scales, self.errors)

    @cached_property
    def _terminal(self) -> TubeProgram:
        f = self.nominal.formulation
        return TubeProgram.terminal_error(f.plant, self.horizon, f.scales, self.errors)

    def _on_reference(self, k: int, state: Array, window: Window) -> Plan | None:
        """Return the plan that stays on the reference, of cost 0: the optimum wherever x ∈ x_r ⊕ Z."""
        f = self.nominal.formulation
        slack = min(Slack.along(f.inequalities, window).smallest, self._start_slack(window.states[0]))
        if slack < -TOLERANCE:
            return None
        u = window.inputs[0] + self.invariant.feedback @ (state - window.states[0])
        return Plan(
            k=k,
            input=self._admissible.pull_inside(u),
            cost=0.0,
            stage_cost=0.0,
            states=window.states,
            inputs=window.inputs,
            slack=slack,
            terminal_residual=0.0,
            status=Status.NO_ACTIVE_BOUND,
        )

    def _widened(self, problem: StepProblem, state: Array, off: Array) -> Plan | Infeasible:
        """Return a plan that needs a widening below the tolerance, or tell how much is needed."""
        found = self._optimum(self._widening, problem, off)
        if found is None:
            raise ArithmeticError("the numbers are beyond the solver")
        plan = self._plan(problem, state, *found, Status.WIDENED)
        if plan.slack >= -TOLERANCE:
            return plan
        f = self.nominal.formulation
        errors, v = plan.states[1:] - problem.window.states[1:], plan.inputs - problem.window.inputs
        quantity, ahead = problem.slack.remaining(f.inequalities, errors, v).tightest
        constraint, closest = f.plant.given_constraints[quantity], self._closest(problem, state, off)
        return Infeasible(
            k=problem.k,
            widening=-plan.slack,
            quantity=constraint.name,
            at_step=problem.k + ahead,
            excess=-plan.slack * constraint.bounds.width,
            terminal_error=None if closest is None else closest.states[-1] - problem.window.states[-1],
            fallback=(closest or plan).input,
            is_local=False,
        )

    def _closest(self, problem: StepProblem, state: Array, off: Array) -> Plan | None:
        """Return the plan in the tightened sets that ends closest to the reference (in scales), and costs the least of
        those with that end; None where no plan is found."""
        found = self._optimum(self._terminal, problem, off, by=TOLERANCE)
        if found is None:
            return None
        nearest = self._plan(problem, state, *found, Status.WIDENED)
        end = nearest.states[-1] - problem.window.states[-1]
        found = self._optimum(self._tracking, problem, off, end, by=2 * TOLERANCE)
        return nearest if found is None else self._plan(problem, state, *found, Status.WIDENED)

    def _optimum(
        self, program: TubeProgram, problem: StepProblem, off: Array, end: Array | float = 0.0, by: float = 0.0
    ) -> tuple[Array, Array] | None:
        """Return the optimal e(0) (n,) and v (N, m) in their units, all bounds widened by a part of their widths."""
        scales = self.nominal.formulation.scales
        X = self.nominal.formulation.inequalities.states
        start = (X.bounds - X.rows @ problem.window.states[0]) / X.widths
        model = problem.model
        slack = problem.slack.widened(by) if by else problem.slack
        missed = np.broadcast_to(end, off.shape) / scales.states
        found = program.solve(model.scaled, off, model.defects / scales.states, start + by, slack, missed)
        return None if found is None else (found[0] * scales.states, found[1] * scales.inputs)

    def _start_slack(self, z: Array) -> float:
        """Return the smallest slack of the nominal start, in parts of the widths."""
        X = self.nominal.formulation.inequalities.states
        return float(np.min((X.bounds - X.rows @ z) / X.widths, initial=np.inf))

    def _problem(self, k: int, start: Array, window: Window) -> StepProblem:
        f = self.nominal.formulation
        return StepProblem(f, k, start, window, f.local_model(window, window))

    def _plan(self, problem: StepProblem, state: Array, error: Array, v: Array, status: Status) -> Plan:
        """Return the plan whose nominal start is x_r + `error`: its slack counts from there, its input is u."""
        window = problem.window
        z = window.states[0] + error
        nominal = self._problem(problem.k, z, window).plan(v, status)
        return Plan(
            k=problem.k,
            input=self._admissible.pull_inside(nominal.inputs[0] + self.invariant.feedback @ (state - z)),
            cost=nominal.cost,
            stage_cost=nominal.stage_cost,
            states=nominal.states,
            inputs=nominal.inputs,
            slack=min(nominal.slack, self._start_slack(z)),
            terminal_residual=nominal.terminal_residual,
            status=status,
        )
