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
from trackably.control.bounds import AdmissiblePoints, Inequalities, Scales, Slack
from trackably.control.controller import Controller
from trackably.control.error_model import ErrorModel, LinearQuadratic
from trackably.control.error_set import ErrorSet, Nearest, nearest_in
from trackably.control.problem import TOLERANCE, Formulation, StepProblem
from trackably.control.programs import CompiledProgram, StepVariables, squared
from trackably.control.references import TrackedReference, check_window
from trackably.control.stepping import ROUNDING, Infeasible, Plan, Status, StepArguments, StepResult, Unsolved
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.disturbance.invariant import InvariantSet
from trackably.systems.disturbance.tightening import Tightening
from trackably.systems.reference import Window

_SMALLEST = 1e-6
"""A start whose cost is flatter in a direction than this part of its steepest has no optimum in float64."""


@dataclass(frozen=True, eq=False)
class StartCost:
    """V(e(0)) = ‖root (e(0) − e*)‖² + const: the optimal cost without bounds, as a function of the start, all scaled.

    The cheapest start e* is linear in the defects; it is the reference itself where there are none.
    """

    optimum: LinearQuadratic

    @property
    def root(self) -> Array:
        """An upper triangular matrix (n, n)."""
        return self._factors[1]

    @cached_property
    def is_strict(self) -> bool:
        """Whether every other start than e* costs more, in float64."""
        sizes = np.linalg.svd(self.root, compute_uv=False)
        return bool(np.all(np.isfinite(sizes)) and sizes[-1] > _SMALLEST * sizes[0])

    def cheapest(self, defects: Array) -> Array:
        """Return e* (n,) for defects (N, n)."""
        return np.asarray(self._of_defects @ defects.ravel())

    @cached_property
    def _of_defects(self) -> Array:
        orthogonal, root = self._factors
        return np.asarray(-scipy.linalg.solve_triangular(root, orthogonal.T @ self._weighted(self.optimum.model.drift)))

    @cached_property
    def _factors(self) -> tuple[Array, Array]:
        n = len(self.optimum.Q)
        stacked = np.vstack([square_root(self.optimum.Q), self._weighted(self.optimum.model.free)])
        orthogonal, root = np.linalg.qr(stacked)
        return np.asarray(orthogonal[n:]), np.asarray(root)

    def _weighted(self, unforced: Array) -> Array:
        """Return weighted errors e(1), …, e(N − 1) and inputs for columns of unforced errors (N n, …)."""
        n, gain = len(self.optimum.Q), self.optimum.gain
        v = gain @ unforced
        e = (unforced + self.optimum.model.forced @ v)[:-n]
        Q, R = square_root(self.optimum.Q), square_root(self.optimum.R)
        by_step = [
            np.einsum("ab,ibc->iac", root, of.reshape(-1, len(root), of.shape[1])) for root, of in ((Q, e), (R, v))
        ]
        return np.vstack([of.reshape(-1, unforced.shape[1]) for of in by_step])


def square_root(weight: Array) -> Array:
    """Return S (n, n) with Sᵀ S = `weight`, which is positive semidefinite."""
    values, vectors = np.linalg.eigh(weight)
    return np.asarray(np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T)


_ACCURACY = 1e-9
"""Bounds may be broken by this part of their widths, and Z be left by this part of its own."""

_MOST_CUTS = 40
_WORST_CONDITION = 1e8
_FLAT = 1e-3
"""Of the scales: Z counts as wider by this much, so that `_ACCURACY` means something where it is flat."""


@dataclass(frozen=True, eq=False)
class BoundedOptimum:
    """min Σ_(i<N) ‖e(i)‖²_Q + ‖v(i)‖²_R with x − z(0) ∈ Z, e(N) = 0, and e, v within their slack.

    Plans p = (e(0), v(0), …, v(N − 1), d) with defects d (N n,) that end on the reference are p = `_basis` q + `_drift`
    d, in such coordinates q that the cost is ‖q − q_d‖² + const, with q_d linear in d. So the optimum is the point of a
    polyhedron that is nearest to q_d. Its rows are the bounds that some q on the way breaks, and half-spaces that hold
    Z.
    """

    formulation: Formulation
    nearest: Nearest

    def solve(self, off: Array, defects: Array, start_slack: Array, slack: Slack) -> tuple[Array, Array] | None:
        """Return the optimal e(0) (n,) and v (N, m), scaled; None where there are none. LinAlgError: not found.

        `off` (n,) is x − x_r in its unit, all else is scaled. It is the optimum of a relaxation that keeps every bound
        up to `_ACCURACY`, with multipliers that are not negative (`nearest_in`).
        """
        if not self._is_solvable:
            raise np.linalg.LinAlgError("the cost does not tell plans apart")
        (N, m), n, scales = (self.formulation.horizon, len(self.formulation.R)), len(off), self.formulation.scales
        drift = self._drift @ defects.ravel()
        rows, limits = self._rows, np.concatenate([start_slack, slack.states[:-1].ravel(), slack.inputs.ravel()])
        limits, q_d = limits - self._bounds @ drift, -self._basis_of_cost.T @ (self._cost @ drift)
        q, active, cuts, cut_limits = q_d, np.zeros(len(limits), bool), np.zeros((0, len(q_d))), np.zeros(0)
        for _ in range(_MOST_CUTS):
            plan = drift + self._basis @ q
            broken, cut = rows @ q > limits + _ACCURACY, self._cut(off - plan[:n] * scales.states)
            if cut is None and not np.any(broken):
                return plan[:n], plan[n : n + N * m].reshape(N, m)
            active |= broken
            if cut is not None:  # row · (off − e(0)) ≤ limit
                row, limit = cut[0] * scales.states, cut[1] - cut[0] @ off
                cuts = np.vstack([cuts, -row @ self._basis[:n]])
                cut_limits = np.append(cut_limits, limit + row @ drift[:n])
            found = nearest_in(np.vstack([rows[active], cuts]), np.append(limits[active], cut_limits), q_d)
            if found is None:
                return None
            q = found
        raise np.linalg.LinAlgError("too many half-spaces are needed")

    def _cut(self, error: Array) -> tuple[Array, float] | None:
        """Return a row (n,) and its support h_Z, 1 wide, that an error breaks by more than `_ACCURACY`; None in Z."""
        errors = self.nearest.errors
        if errors.halfspaces is not None:
            rows, limits = errors.halfspaces
            beyond = (rows @ error - limits) / self._widths
            at = int(np.argmax(beyond))
            row, limit, width = rows[at], limits[at], self._widths[at]
        else:
            inside = self.nearest(error)
            if inside is None:
                raise np.linalg.LinAlgError("the nearest error in Z is not found")
            row = self.nearest.normal(error, inside)
            limit, low = errors.support(np.vstack([row, -row]))
            width = limit + low + self._least(row)
        return (row / width, float(limit / width)) if row @ error - limit > _ACCURACY * width else None

    @cached_property
    def _widths(self) -> Array:
        """How wide Z is in the direction of each of its half-spaces; nearly zero where it is flat."""
        errors = self.nearest.errors
        rows, limits = errors.halfspaces or (np.zeros((0, errors.dimension)), np.zeros(0))
        return np.asarray(limits + errors.support(-rows) + self._least(rows))

    def _least(self, rows: Array) -> Array:
        return np.asarray(_FLAT * np.linalg.norm(rows * self.formulation.scales.states, axis=-1))

    @cached_property
    def _is_solvable(self) -> bool:
        """Whether the cost tells all plans apart in float64, so that there is one optimum."""
        return bool(self._triangular.size and np.linalg.cond(self._triangular) < _WORST_CONDITION)

    @cached_property
    def _basis(self) -> Array:
        """Plans p without defects that end on the reference."""
        return np.asarray(scipy.linalg.solve_triangular(self._triangular, self._ending.T, trans="T").T)

    @cached_property
    def _triangular(self) -> Array:
        return np.asarray(np.linalg.qr(self._cost @ self._ending, mode="r"))

    @cached_property
    def _ending(self) -> Array:
        """The same plans as orthonormal columns."""
        found = scipy.linalg.null_space(self._end)
        return np.vstack([found, np.zeros((self._cost.shape[1] - len(found), found.shape[1]))])

    @cached_property
    def _basis_of_cost(self) -> Array:
        """The orthonormal columns that the cost makes of the basis."""
        return np.asarray(self._cost @ self._basis)

    @cached_property
    def _rows(self) -> Array:
        return np.asarray(self._bounds @ self._basis)

    @cached_property
    def _drift(self) -> Array:
        """For each defect the smallest plan p that ends on the reference nevertheless."""
        free = self._model.drift
        return np.vstack([-np.linalg.pinv(self._end) @ free[-len(self.formulation.Q) :], np.eye(len(free))])

    @cached_property
    def _end(self) -> Array:
        """e(N) of e(0) and v, without defects."""
        n = len(self.formulation.Q)
        return np.hstack([self._model.free[-n:], self._model.forced[-n:]])

    @cached_property
    def _cost(self) -> Array:
        """The cost of p is ‖`_cost` p‖²."""
        Q, R = self.formulation.scaled_weights
        return self._each_step(square_root(Q), square_root(R))

    @cached_property
    def _bounds(self) -> Array:
        """`_bounds` p ≤ slack: the bounds of z(0), …, z(N − 1), then those of v, in parts of the widths."""
        X, U, scales = (
            self.formulation.inequalities.states,
            self.formulation.inequalities.inputs,
            self.formulation.scales,
        )
        return self._each_step(X.rows * scales.states / X.widths[:, None], U.rows * scales.inputs / U.widths[:, None])

    def _each_step(self, of_state: Array, of_input: Array) -> Array:
        """Return the matrix that makes of p the rows of e(0), …, e(N − 1), then those of v(0), …, v(N − 1)."""
        m, (N, n, _) = self._model, self._model.A.shape
        size = n + m.forced.shape[1] + N * n
        errors = np.vstack([np.eye(n, size), np.hstack([m.free, m.forced, m.drift])[:-n]])
        inputs = np.eye(m.forced.shape[1], size, n)
        return np.vstack([np.kron(np.eye(N), of_state) @ errors, np.kron(np.eye(N), of_input) @ inputs])

    @property
    def _model(self) -> ErrorModel:
        return self.formulation.linear_optimum.model


@dataclass(frozen=True, eq=False)
class Membership:
    """The constraint x − z(0) ∈ Z on e(0) = (z(0) − x_r) / scales, affine in a parameter made of x − x_r."""

    errors: ErrorSet
    scales: Array
    parameter: cp.Parameter

    @classmethod
    def of(cls, errors: ErrorSet, scales: Array) -> Membership:
        sides = _sides(errors)
        return cls(errors, scales, cp.Parameter(errors.dimension if sides is None else len(sides[0])))

    def constraints(self, start: cp.Expression) -> list[cp.Constraint]:
        """Return the constraints on the scaled e(0) (n,)."""
        if (sides := _sides(self.errors)) is not None:
            rows = sides[0] * self.scales
            return [-(rows / np.linalg.norm(rows, axis=1, keepdims=True)) @ start <= self.parameter]
        G = self.errors.generators.T / self.scales[:, None]
        weights = cp.Variable(G.shape[1])
        total, constraints = start + G @ weights, [weights <= 1, weights >= -1]
        N, v, n = self.errors.hulls.shape
        if N:  # a point of each hull
            parts = cp.Variable((N, v), nonneg=True)
            vertices = self.errors.hulls.reshape(N * v, n).T / self.scales[:, None]
            total = total + vertices @ cp.vec(parts, order="C")
            constraints.append(cp.sum(parts, axis=1) == 1)
        return [total == self.parameter, *constraints]

    def assign(self, off: Array) -> None:
        """Give the parameter its value for x − x_r = `off` (n,)."""
        if (sides := _sides(self.errors)) is not None:
            rows, limits = sides
            self.parameter.value = (limits - rows @ off) / np.linalg.norm(rows * self.scales, axis=1)
        else:
            self.parameter.value = (off - self.errors.centre) / self.scales


@dataclass(frozen=True, eq=False)
class TubeProgram:
    """A program in e(0), …, e(N) and v(0), …, v(N − 1), all scaled. It ends on the reference."""

    variables: StepVariables
    membership: Membership
    start_slack: cp.Parameter
    compiled: CompiledProgram

    @classmethod
    def tracking(
        cls, plant: ConstrainedSystem, horizon: int, scales: Scales, Q: Array, R: Array, errors: ErrorSet
    ) -> TubeProgram:
        """Return min Σ_(i<N) ‖e(i)‖²_Q + ‖v(i)‖²_R with x − z(0) ∈ Z, z in X for all i < N, and v in U."""
        s = StepVariables.of(plant, horizon)
        scaled_Q, scaled_R = scales.weights(Q, R)
        return cls._of(s, plant, scales, errors, squared(s.e[:-1], scaled_Q) + squared(s.v, scaled_R), 0.0)

    @classmethod
    def terminal_error(cls, plant: ConstrainedSystem, horizon: int, scales: Scales, errors: ErrorSet) -> TubeProgram:
        """Return min ‖e(N)‖ (Euclidean, in scales) with x − z(0) ∈ Z and all bounds kept."""
        s = StepVariables.of(plant, horizon)
        return cls._of(s, plant, scales, errors, cp.sum_squares(s.e[horizon]), 0.0, ends=False)

    @classmethod
    def widening(cls, plant: ConstrainedSystem, horizon: int, scales: Scales, errors: ErrorSet) -> TubeProgram:
        """Return the least part of their widths by which all sets must grow, or the most they may shrink."""
        by = cp.Variable()
        return cls._of(StepVariables.of(plant, horizon), plant, scales, errors, by, by)

    @classmethod
    def _of(
        cls,
        s: StepVariables,
        plant: ConstrainedSystem,
        scales: Scales,
        errors: ErrorSet,
        cost: cp.Expression,
        widening: cp.Expression | float,
        ends: bool = True,
    ) -> TubeProgram:
        membership = Membership.of(errors, scales.states)
        start_slack = cp.Parameter(2 * len(plant.state_set.rows))
        constraints = [*s.dynamics()[1:], *([s.ends()] if ends else []), *membership.constraints(s.e[0])]
        constraints += s.bounds(plant, scales, widening)
        if len(plant.state_set.rows):
            given = Inequalities.of(plant.state_set)
            rows = given.rows * scales.states / given.widths[:, None]
            constraints.append(rows @ s.e[0] <= start_slack + widening * np.ones(start_slack.shape))
        problem = cp.Problem(cp.Minimize(cost), constraints)
        return cls(s, membership, start_slack, CompiledProgram(problem))

    def solve(
        self, model: ErrorModel, off: Array, defects: Array, start_slack: Array, slack: Slack, end: Array
    ) -> tuple[Array, Array] | None:
        """Return the optimal scaled e(0) (n,) and v (N, m) with e(N) = `end`; None where the solver finds none.

        `off` (n,) is x − x_r in its unit, all else is scaled. Raises ArithmeticError where a number is not finite.
        """
        self.variables.assign(model, np.zeros_like(off), defects, slack, end)
        self.start_slack.value = start_slack
        self.membership.assign(off)
        found = self.compiled.solve()
        if found is None:
            return None
        return np.asarray(found[self.variables.e.id])[0], np.asarray(found[self.variables.v.id])


def _sides(errors: ErrorSet) -> tuple[Array, Array] | None:
    """Return the half-spaces of a polygon or an interval; of more states its parts make a smaller program."""
    return errors.halfspaces if errors.dimension <= 2 else None


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
        return StartCost(self.nominal.linear_optimum)

    @cached_property
    def nearest(self) -> Nearest:
        """The nominal start of least cost where no bound is active: the distance is the one that the cost defines."""
        return Nearest(self.errors, self.start_cost.root / self.nominal.scales.states)

    @cached_property
    def bounded(self) -> BoundedOptimum:
        return BoundedOptimum(self.nominal, self.nearest)

    @cached_property
    def tracking(self) -> TubeProgram:
        f = self.nominal
        return TubeProgram.tracking(f.plant, f.horizon, f.scales, f.Q, f.R, self.errors)

    @cached_property
    def widening(self) -> TubeProgram:
        f = self.nominal
        return TubeProgram.widening(f.plant, f.horizon, f.scales, self.errors)

    @cached_property
    def terminal_error(self) -> TubeProgram:
        f = self.nominal
        return TubeProgram.terminal_error(f.plant, f.horizon, f.scales, self.errors)

    @cached_property
    def admissible(self) -> AdmissiblePoints:
        """The points of the given input set."""
        return AdmissiblePoints(self.tightening.given.input_set)

    def start_slack(self, z: Array) -> Array:
        """Return what a nominal start z (n,) leaves to the bounds of states, in parts of the widths."""
        X = self.nominal.inequalities.states
        return np.asarray((X.bounds - X.rows @ z) / X.widths)


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
        accuracy of the active-set method (1e-9 of the widths) or, where that fails, of the interior-point method.

        The optimum needs no `initial_guess` (N, m). Where the solver fails, the plan with these nominal inputs is taken
        if it is one, with the status `KEPT`. On a robust reference the last plan, shifted by a step (`shifted_inputs`),
        is one, and its start is found again. In directions that Aᴺ forgets in float64 it is another start, with which
        the plan may cost more. Raises ValueError as `Controller.step`.
        """
        k, x, guess = StepArguments.checked(k, state, reference, initial_guess, self.plant, self.horizon)
        try:
            with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # what is not finite is found later
                window = reference.window(k, self.horizon)
                check_window(window, self.nominal.shape)
                if not all(np.isfinite(values).all() for values in window):
                    raise ArithmeticError("the reference is not defined")
                return self._solved(k, x, window, guess)
        except (ArithmeticError, np.linalg.LinAlgError) as error:
            return Unsolved(k, str(error), self.formulation.admissible.first_finite(()))

    def _solved(self, k: int, state: Array, window: Window, guess: Array | None) -> Plan | Infeasible:
        problem = TubeProblem(self.formulation, k, state, window)
        kept = None if problem.optimum or guess is None else problem.kept(guess)
        return problem.optimum or kept or problem.widened

    @cached_property
    def formulation(self) -> TubeFormulation:
        """The programs, built once for all steps."""
        return TubeFormulation(self.tightening, self.nominal.formulation)
