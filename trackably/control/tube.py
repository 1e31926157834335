"""Tube model predictive control: a nominal plan on the reference, and a feedback that keeps the state near it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import cvxpy as cp
import numpy as np
import scipy

from trackably.arguments import instance
from trackably.arrays import Array, ArrayLike
from trackably.control.bounds import AdmissiblePoints, Inequalities, Scales
from trackably.control.controller import Controller
from trackably.control.error_model import LinearQuadratic
from trackably.control.error_set import ErrorSet, Nearest
from trackably.control.problem import TOLERANCE, Formulation, StepProblem
from trackably.control.programs import CompiledProgram, StepPrograms
from trackably.control.references import TrackedReference
from trackably.control.stepping import ROUNDING, Infeasible, Plan, Status, StepResult, answer_step
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.reference import Window
from trackably.systems.tightening import InvariantSet, Tightening

_SMALLEST = 1e-6
"""A start whose cost is flatter in a direction than this part of its steepest has no optimum in float64."""


@dataclass(frozen=True, eq=False)
class StartCost:
    """V(e(0)) = ‖root (e(0) − e*)‖² + const: the optimal cost without bounds, as a function of the start, all scaled.

    `root` (n, n) is upper triangular. The cheapest start e* = `of_defects` d is linear in the defects d (N n,); it is
    the reference itself where there are none.
    """

    root: Array
    of_defects: Array

    @classmethod
    def of(cls, optimum: LinearQuadratic) -> StartCost:
        """Return the cost of the starts of plans that are optimal without bounds."""
        model, (N, n, _) = optimum.model, optimum.model.A.shape
        Q, R = (np.kron(np.eye(N), _square_root(weight)) for weight in (optimum.Q, optimum.R))

        def weighted(starts: Array, unforced: Array) -> Array:
            """Return weighted errors e(0), …, e(N − 1) and inputs, for starts and the errors without inputs."""
            v = optimum.gain @ unforced
            return np.vstack([Q @ np.vstack([starts, unforced + model.forced @ v])[:-n], R @ v])

        orthogonal, root = np.linalg.qr(weighted(np.eye(n), model.free))
        of_defects = weighted(np.zeros((n, N * n)), model.drift)
        if not abs(np.diag(root)).min() > 0:
            return cls(root, np.zeros((n, N * n)))
        return cls(root, np.asarray(-scipy.linalg.solve_triangular(root, orthogonal.T @ of_defects)))

    @cached_property
    def is_strict(self) -> bool:
        """Whether every other start than e* costs more, in float64."""
        sizes = np.linalg.svd(self.root, compute_uv=False)
        return bool(np.all(np.isfinite(sizes)) and sizes[-1] > _SMALLEST * sizes[0])


def _square_root(weight: Array) -> Array:
    """Return S (n, n) with Sᵀ S = `weight`, which is positive semidefinite."""
    values, vectors = np.linalg.eigh(weight)
    return np.asarray(np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T)


@dataclass(frozen=True, eq=False)
class FreeStart:
    """A `Start` with x − z(0) ∈ Z and z(0) in the state set: e(0) = (z(0) − x_r) / scales is a variable."""

    errors: ErrorSet
    bounds: Inequalities
    scales: Scales

    @cached_property
    def off(self) -> cp.Parameter:
        return cp.Parameter(self.errors.dimension)

    @cached_property
    def slack(self) -> cp.Parameter:
        return cp.Parameter(len(self.bounds.rows))

    def constraints(self, start: cp.Expression, widening: cp.Expression | float) -> list[cp.Constraint]:
        total, constraints = start, []
        if len(G := self.errors.generators / self.scales.states):
            weights = cp.Variable(len(G))
            total, constraints = total + G.T @ weights, [weights <= 1, weights >= -1]
        N, v, n = self.errors.hulls.shape
        if N:  # a point of each hull
            parts = cp.Variable((N, v), nonneg=True)
            vertices = self.errors.hulls.reshape(N * v, n) / self.scales.states
            total = total + vertices.T @ cp.vec(parts, order="C")
            constraints.append(cp.sum(parts, axis=1) == 1)
        if len(self.bounds.rows):
            rows = self.bounds.in_widths(self.scales.states)
            constraints.append(rows @ start <= self.slack + widening * np.ones(self.slack.shape))
        return [total == self.off, *constraints]

    def assign(self, off: Array, slack: Array) -> None:
        self.off.value, self.slack.value = (off - self.errors.centre) / self.scales.states, slack


@dataclass(frozen=True, eq=False)
class TubeFormulation:
    """The programs of a `nominal` formulation with tightened sets and a nominal start in x ⊖ Z, each built when first
    used."""

    tightening: Tightening
    nominal: Formulation

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

    @cached_property
    def start_cost(self) -> StartCost:
        return StartCost.of(self.nominal.linear_optimum)

    @cached_property
    def nearest(self) -> Nearest:
        """The nominal start of least cost where no bound is active: the distance is the one that the cost defines."""
        return Nearest(self.errors, self.start_cost.root / self.nominal.scales.states)

    @cached_property
    def programs(self) -> StepPrograms:
        f = self.nominal
        start = FreeStart(self.errors, f.inequalities.states, f.scales)
        return StepPrograms(f.plant, f.horizon, f.scales, f.scaled_weights, start)

    @cached_property
    def admissible(self) -> AdmissiblePoints:
        """The points of the given input set."""
        return AdmissiblePoints(self.tightening.given.input_set)

    def start_slack(self, z: Array) -> Array:
        """Return what a nominal start z (n,) leaves to the bounds of states, in parts of the widths."""
        return self.nominal.inequalities.states.slack(z)


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
            return self.without_bounds() or self.solved()
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
        scales = f.nominal.scales.states
        free = self.off - f.start_cost.of_defects @ (self.nominal.model.defects / scales).ravel() * scales
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

    def solved(self) -> Plan | None:
        """Return the optimum by an interior-point method, if that finds it."""
        plan = self._solved(self.formulation.programs.tracking, status=Status.SOLVED)
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
        plan = self._solved(self.formulation.programs.widening)
        if plan is None:
            raise ArithmeticError("the numbers are beyond the solver")
        return plan if plan.slack >= -TOLERANCE else self.nominal.explain(plan, self.closest, self.closest or plan)

    @cached_property
    def closest(self) -> Plan | None:
        """The plan in the tightened sets that ends closest to the reference (in scales), and costs the least of those
        with that end; None where no plan is found."""
        programs = self.formulation.programs
        nearest = self._solved(programs.terminal_error, by=TOLERANCE)
        if nearest is None:
            return None
        end = nearest.states[-1] - self.window.states[-1]
        return self._solved(programs.tracking, end, by=2 * TOLERANCE) or nearest

    def plan(self, start: Array, v: Array, status: Status) -> Plan:
        """Return the plan whose nominal start is x_r + `start`: its slack counts from there, its input is u."""
        f, z = self.formulation, self.window.states[0] + start
        u = f.admissible.pull_inside(self.window.inputs[0] + v[0] + f.invariant.feedback @ (self.state - z))
        problem = StepProblem(f.nominal, self.k, z, self.window, self.nominal.model)
        return problem.applying(u, v, status, float(f.start_slack(z).min(initial=np.inf)))

    def _solved(
        self,
        program: CompiledProgram,
        end: Array | float = 0.0,
        by: float = 0.0,
        status: Status = Status.WIDENED,
    ) -> Plan | None:
        """Return the plan that a program finds, with all bounds widened by a part of their widths."""
        f, model = self.formulation, self.nominal.model
        slack, start_slack = self.nominal.slack.widened(by), f.start_slack(self.window.states[0]) + by
        found = f.programs.solve(program, model.scaled, self.off, model.defects, slack, start_slack, end)
        return None if found is None else self.plan(*found, status)


def _admissible(plan: Plan) -> Plan | None:
    return plan if plan.slack >= -TOLERANCE else None


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

    Weights that are left out are those of `Controller` for the tightened sets. Raises ValueError and TypeError as it
    does, and where nothing is disturbed.
    """

    tightening: Tightening
    horizon: int
    Q: Array = None  # type: ignore[assignment]  # replaced by an array, as is all that is given
    R: Array = None  # type: ignore[assignment]

    if TYPE_CHECKING:

        def __init__(
            self, tightening: Tightening, horizon: int, Q: ArrayLike | None = None, R: ArrayLike | None = None
        ) -> None: ...

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

    @property
    def invariant(self) -> InvariantSet:
        """The invariant set Z of the error, with the feedback K."""
        return self.formulation.invariant

    @property
    def errors(self) -> ErrorSet:
        """The same set in float64."""
        return self.formulation.errors

    def step(
        self, k: int, state: ArrayLike, reference: TrackedReference, initial_guess: ArrayLike | None = None
    ) -> StepResult:
        """Return the optimal plan at step `k` from the measured `state` (n,), or why there is none.

        The `states` and `inputs` of a `Plan` are nominal, and so are its cost and slack; its `input` is the one to
        apply, inside the given input set. `Infeasible` tells by how much the tightened sets would have to be widened,
        and how close a plan comes to the reference that keeps them; its fallback begins that plan.

        A plan is optimal: where no bound is active up to a few 1e-9 of its cost (`Nearest`), elsewhere up to the
        accuracy of the interior-point method.

        The optimum needs no `initial_guess` (N, m). Where the solver fails, the plan with these nominal inputs is taken
        if it is one, with the status `KEPT`. On a robust reference the last plan, shifted by a step (`shifted_inputs`),
        is one, and its start is found again. In directions that Aᴺ forgets in float64 it is another start, with which
        the plan may cost more. Raises ValueError as `Controller.step`.
        """
        return answer_step(self, self._solved, self.formulation.admissible, (k, state, reference, initial_guess))

    def _solved(self, k: int, state: Array, window: Window, guess: Array | None) -> Plan | Infeasible:
        problem = TubeProblem(self.formulation, k, state, window)
        kept = None if problem.optimum or guess is None else problem.kept(guess)
        return problem.optimum or kept or problem.widened

    @cached_property
    def formulation(self) -> TubeFormulation:
        """The programs, built once for all steps."""
        return TubeFormulation(self.tightening, self.nominal.formulation)
