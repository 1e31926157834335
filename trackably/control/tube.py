"""Tube model predictive control: a nominal plan on the reference, and a feedback that keeps the state near it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from math import comb
from typing import TYPE_CHECKING

import numpy as np
import scipy

from trackably.arguments import instance
from trackably.arrays import Array, ArrayLike
from trackably.control.bounds import AdmissiblePoints
from trackably.control.controller import Controller
from trackably.control.error_model import LinearQuadratic
from trackably.control.problem import TOLERANCE, Formulation, StepProblem
from trackably.control.programs import StartSet
from trackably.control.references import TrackedReference
from trackably.control.stepping import Infeasible, Plan, Status, StepResult, answer_step
from trackably.gp.bounded import nonnegative_least_squares
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.disturbances import Zonotope
from trackably.systems.reference import Window
from trackably.systems.tightening import InvariantSet, Tightening

# The invariant set of the error in float64, and its point nearest to another point.

_ROUNDING, _OF_LEAST_SQUARES = 1e-12, 1e-9
"""Tolerances of membership, relative to the size of the set along each axis: with facets, and without them."""

_MOST_FACETS = 100_000

_GAP = 1e-9
"""A point counts as nearest if no other is nearer by more than twice this part of the squared distance."""

_LEAST_GAP = 1e-13
"""Gap that rounding leaves if a point is hardly outside, relative to the squared size of the searched points."""

_DIRECTIONS, _BEGUN = 1000, 8
_MOST_ROUNDS = 100


@dataclass(frozen=True, eq=False)
class ErrorSet:
    """Z of an invariant set: its parts ⊕_{i<N} A_Kⁱ W ⊕ A_Kᴺ (1 − α)⁻¹ ⊕_{i<s} A_Kⁱ P, summed in float64.

    It is `centre` ⊕ {Σ_j ξ_j g_j : |ξ_j| ≤ 1} ⊕ the convex hulls `hulls`. If W is a zonotope, there are no hulls and Z
    is a zonotope. If W is a convex hull, each A_Kⁱ W is a hull, and the generators g_j are those of P.
    """

    invariant: InvariantSet

    @property
    def dimension(self) -> int:
        return len(self.invariant.box)

    def contains(self, e: Array) -> bool:
        """Whether an error (n,) is in Z, up to rounding. LinAlgError: it cannot be decided in float64."""
        if self.facets is None:
            return Nearest(self, np.diag(1 / self.extents))(e) is e
        rows, limits = self.facets
        return bool((rows @ e <= limits).all())

    def support(self, rows: Array) -> Array:
        """Return h_Z(row) for rows (…, n): shape (…)."""
        found = rows @ self.centre + np.abs(rows @ self.generators.T).sum(axis=-1)
        for hull in self.hulls:
            found = found + np.max(rows @ hull.T, axis=-1)
        return np.asarray(found)

    def farthest(self, row: Array) -> Array:
        """Return a vertex (n,) of Z at which row · e is largest, up to rounding."""
        found = self.centre + np.where(self.generators @ row >= 0, 1.0, -1.0) @ self.generators
        if len(self.hulls):
            found = found + self.hulls[np.arange(len(self.hulls)), np.argmax(self.hulls @ row, axis=1)].sum(axis=0)
        return np.asarray(found)

    @cached_property
    def extents(self) -> Array:
        """The width of Z along each axis (n,); 1 if it is zero."""
        axes = np.eye(self.dimension)
        reach = self.support(axes) + self.support(-axes)
        return np.where(reach > 0, reach, 1.0)

    @cached_property
    def vertices(self) -> Array:
        """Distinct vertices (v, n) of Z, those in many random directions, with a fixed seed."""
        directions = np.random.default_rng(0).standard_normal((_DIRECTIONS, self.dimension)) / self.extents
        points = np.array([self.farthest(direction) for direction in directions])
        _, chosen = np.unique(np.round(points / self.extents, 9), axis=0, return_index=True)
        return points[chosen]

    @cached_property
    def centre(self) -> Array:
        """The centre (n,) of the generators."""
        Z = self.invariant
        if not isinstance(Z.disturbance, Zonotope):
            return np.zeros(self.dimension)
        at, total = Z.disturbance.matrix[0], np.zeros(self.dimension)
        for _ in range(Z.head):
            total, at = total + at, Z.closed_loop @ at
        return total

    @cached_property
    def generators(self) -> Array:
        """The generators (g, n), none of them zero."""
        Z, W = self.invariant, self.invariant.disturbance
        of_head = W.generator_matrix if isinstance(W, Zonotope) else np.zeros((0, self.dimension))
        found, head, tail = [], of_head, np.diag(Z.box) / (1 - Z.contraction)
        for i in range(Z.head + Z.terms):
            found.append(head if i < Z.head else tail)
            head, tail = head @ Z.closed_loop.T, tail @ Z.closed_loop.T
        stacked = np.vstack(found)
        return np.asarray(stacked[np.any(stacked != 0, axis=1)])

    @cached_property
    def hulls(self) -> Array:
        """The vertices (N, v, n) of A_Kⁱ W for i < N; empty if W is a zonotope."""
        Z, W = self.invariant, self.invariant.disturbance
        if isinstance(W, Zonotope):
            return np.zeros((0, 1, self.dimension))
        found = [W.matrix]
        while len(found) < Z.head:
            found.append(found[-1] @ Z.closed_loop.T)
        return np.array(found)

    @cached_property
    def facets(self) -> tuple[Array, Array] | None:
        """H (f, n) and h (f,) with Z = {e : H e ≤ h}, up to rounding; None for hulls, flat sets, and too many facets.

        A facet of a zonotope is spanned by n − 1 of its generators.
        """
        G, n = self.generators / self.extents, self.dimension
        if len(self.hulls) or comb(len(G), n - 1) > _MOST_FACETS or np.linalg.matrix_rank(G) < n:
            return None
        unit = G / np.linalg.norm(G, axis=1, keepdims=True)
        spanning = unit[np.array(list(combinations(range(len(G)), n - 1)), dtype=int)]
        normals = np.stack([(-1) ** i * np.linalg.det(np.delete(spanning, i, axis=2)) for i in range(n)], axis=1)
        sizes = np.linalg.norm(normals, axis=1)
        rows = normals[sizes > _ROUNDING] / sizes[sizes > _ROUNDING, None]
        _, chosen = np.unique(np.round(rows, 12), axis=0, return_index=True)  # of a product, many are the same
        rows = np.vstack([rows[chosen], -rows[chosen]]) / self.extents
        return rows, self.support(rows) + _ROUNDING * np.abs(rows) @ self.extents


@dataclass(frozen=True, eq=False)
class Nearest:
    """argmin ‖root (e − d)‖ over d ∈ Z, for an invertible `root` (n, n); e itself if e ∈ Z.

    Any other result is a convex combination of vertices of Z, and so it is in Z, up to the rounding of a few sums. The
    method finds the nearest point of the convex hull of a few vertices, beginning with those nearest to e. Then it adds
    the vertex that is farthest in the direction from there to e, and repeats (Wolfe 1976: Finding the nearest point in
    a polytope, Mathematical Programming 11). That vertex also bounds how much nearer any other point can be.
    """

    errors: ErrorSet
    root: Array

    def __call__(self, e: Array) -> Array | None:
        """Return d (n,); None if it is not found up to `_GAP`. LinAlgError: not found in float64."""
        if self.errors.facets is not None and self.errors.contains(e):
            return e
        images, squares = self._images
        aim = self.root @ e
        begun = np.argsort(squares - images @ (2 * aim))[:_BEGUN]
        points, off = self.errors.vertices[begun], images[begun] - aim
        unit, least = float(np.max(np.abs(off))), float("inf")
        if not 0 < unit < np.inf:
            if unit == 0:
                return e
            raise np.linalg.LinAlgError("an error is beyond floating point")
        for _ in range(_MOST_ROUNDS):
            weights = _nearest_to_zero(off / unit)
            used = weights > 0
            points, off, weights = points[used], off[used], weights[used]
            nearest, towards = weights @ points, -weights @ off
            if self.errors.facets is None and np.max(np.abs(e - nearest) / self.errors.extents) <= _OF_LEAST_SQUARES:
                return e
            farthest = self.errors.farthest(self.root.T @ towards)
            image, distance = self.root @ farthest - aim, float(towards @ towards)
            gap = towards @ image + distance
            if gap <= _GAP * distance:
                return np.asarray(nearest)
            if not distance < least:  # rounding hides what is left of the gap
                return np.asarray(nearest) if gap <= _LEAST_GAP * unit**2 else None
            least = distance
            points, off = np.vstack([points, farthest]), np.vstack([off, image])
        return None

    @cached_property
    def _images(self) -> tuple[Array, Array]:
        """The images (v, n) of the vertices, and their squared lengths."""
        images = self.errors.vertices @ self.root.T
        return images, np.einsum("ij,ij->i", images, images)


def _nearest_to_zero(points: Array) -> Array:
    """Return the weights (p,) of the point of the convex hull of `points` that is nearest to zero.

    They are a multiple of the w ≥ 0 that minimise ‖Σ_i w_i points_i‖² + (1 − Σ_i w_i)². Raises LinAlgError if they are
    not found in float64.
    """
    rows = np.vstack([points.T, np.ones(len(points))])
    aim = np.zeros(len(rows))
    aim[-1] = 1.0
    weights = nonnegative_least_squares(rows, aim)
    return np.asarray(weights / np.sum(weights))


_SMALLEST = 1e-6
"""Least ratio of the smallest to the largest singular value of `root` for which the cheapest start is unique."""


@dataclass(frozen=True, eq=False)
class StartCost:
    """V(e(0)) = ‖root (e(0) − e*)‖² + const: the optimal cost without bounds, as a function of the start, all scaled.

    `root` (n, n) is upper triangular. The cheapest start e* = `of_defects` d is linear in the defects d (N n,); without
    defects it is the reference itself.
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
        """Whether every start other than e* costs more, in float64."""
        sizes = np.linalg.svd(self.root, compute_uv=False)
        return bool(np.all(np.isfinite(sizes)) and sizes[-1] > _SMALLEST * sizes[0])


def _square_root(weight: Array) -> Array:
    """Return S (n, n) with Sᵀ S = `weight`, which is positive semidefinite."""
    values, vectors = np.linalg.eigh(weight)
    return np.asarray(np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T)


@dataclass(frozen=True, eq=False)
class TubeFormulation(Formulation):
    """The parts that all steps share, for the nominal system with tightened sets whose start is free in x ⊖ Z."""

    tightening: Tightening

    @cached_property
    def invariant(self) -> InvariantSet:
        """The invariant set Z of the error, with the feedback K."""
        if self.tightening.invariant is None:
            raise ValueError("tube: a disturbance set is needed; without one, Controller tracks the reference")
        return self.tightening.invariant

    @cached_property
    def errors(self) -> ErrorSet:
        """The invariant set Z in float64."""
        return ErrorSet(self.invariant)

    @cached_property
    def start(self) -> StartSet:
        """The set of initial states of plans, scaled: x − z(0) ∈ Z is a sum of generators and of
        a point of each hull.
        """
        errors, scales = self.errors, self.scales.states
        (N, v, n), generators = errors.hulls.shape, len(errors.generators)
        return StartSet(
            errors.centre / scales,
            np.vstack([errors.generators, errors.hulls.reshape(N * v, n)]) / scales,
            np.repeat([-1.0, 0.0], [generators, N * v]),
            np.hstack([np.zeros((N, generators)), np.kron(np.eye(N), np.ones(v))]),
            0,
        )

    @property
    def feedback(self) -> Array:
        """K (m, n), which keeps x − z in Z."""
        return self.invariant.feedback

    @cached_property
    def admissible(self) -> AdmissiblePoints:
        """The points of the given input set."""
        return AdmissiblePoints(self.tightening.given.input_set)

    @cached_property
    def start_cost(self) -> StartCost:
        return StartCost.of(self.linear_model.without_bounds)

    @cached_property
    def nearest(self) -> Nearest:
        """The search for the nominal start of least cost without active bounds; the cost defines the distance."""
        return Nearest(self.errors, self.start_cost.root / self.scales.states)


_FOLLOWED = 1e-12
"""A plan that departs from the reference by less than this, relative to the scales, is the reference."""

_PARTS = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Starts of a kept plan in its free directions, as parts of the way from the reference to the measured state."""


@dataclass(frozen=True, eq=False)
class TubeProblem(StepProblem):
    """A `StepProblem` whose plan starts from a nominal state in x ⊖ Z.

    Most steps need no program. Inside the tube the reference is the plan. Outside, the plan from the start of least
    cost in x ⊖ Z is optimal if no bound is active.
    """

    formulation: TubeFormulation

    @property
    def free_start(self) -> Array | None:
        """The z(0) − x_r of least cost in x ⊖ Z without active bounds; None if it is not found, or not unique.

        Its cost is the squared distance from the cheapest start, up to a constant. So x − z(0) is the point of Z
        nearest to x minus that start (`Nearest` states its accuracy).
        """
        f = self.formulation
        if not f.start_cost.is_strict:
            return np.zeros(len(self.off)) if f.errors.contains(self.off) else None
        scales = f.scales.states
        free = self.off - f.start_cost.of_defects @ (self.model.defects / scales).ravel() * scales
        nearest = f.nearest(free)
        if nearest is None:
            return None
        unforced = self.model.error_model.unforced_errors(start := self.off - nearest, self.model.defects)
        return start if np.abs(unforced / scales).max() > _FOLLOWED else np.zeros(len(start))

    def answer(self, guess: Array | None) -> Plan | Infeasible:
        """Return the optimal plan, or the reason why there is none.

        If the solver finds no plan, the one that keeps the inputs `guess` (N, m) is returned, or else a plan within
        tolerances.
        """
        try:
            plan = self.without_bounds()
        except np.linalg.LinAlgError:  # beyond its numbers
            plan = None
        plan = plan or self.with_bounds() or (None if guess is None else self.keep(guess))
        return plan or self.within_tolerance() or self.infeasible

    def keep(self, inputs: Array) -> Plan | None:
        """Return the plan with these nominal inputs (N, m); None if it is not admissible.

        Its nominal start is one from which the inputs end on the reference (`_starts`). If several starts are tried,
        the plan may cost more than the one that it comes from.
        """
        v = inputs - self.window.inputs
        for start in self._starts(v):
            if self.formulation.errors.contains((1 - TOLERANCE) * (self.off - start)):  # as accurate as the solver is
                plan = self.plan(v, Status.KEPT, start)
                if self.ends_on_reference(plan) and plan.slack >= -TOLERANCE:
                    return plan
        return None

    def _starts(self, v: Array) -> Iterator[Array]:
        """Yield starts e(0) (n,) from which input errors v (N, m) end on the reference: Aᴺ e(0) =
        −(the response to v alone).

        The first start solves this to the accuracy of float64. In a direction that Aᴺ nearly maps to zero, it contains
        rounding errors only. Such a direction hardly affects the end, so the start is free in it: the other starts lie
        on the way from the reference to the measured state.
        """
        model, n, scales = self.model.error_model, len(self.off), self.formulation.scales.states
        missed = model.errors(np.zeros(n), v, self.model.defects)[-1] / scales
        left, sizes, right = np.linalg.svd(model.free[-n:] * scales / scales[:, None])
        for least in (n * np.finfo(float).eps * sizes[0], TOLERANCE):
            counts = sizes > least
            start = -right[counts].T @ (left[:, counts].T @ missed / sizes[counts])
            free = right[~counts].T @ (right[~counts] @ (self.off / scales))
            yield from ((start + part * free) * scales for part in (_PARTS if np.any(~counts) else _PARTS[:1]))


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

    By default, weights are those of `Controller` for the tightened sets. Raises ValueError and TypeError as
    `Controller`, and ValueError without a disturbance.
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
        """The system with its given sets, which states and inputs keep."""
        return self.tightening.given

    @property
    def invariant(self) -> InvariantSet:
        """The invariant set Z of the error, with the feedback K."""
        return self.formulation.invariant

    @property
    def errors(self) -> ErrorSet:
        """The invariant set Z in float64."""
        return self.formulation.errors

    def step(
        self, k: int, state: ArrayLike, reference: TrackedReference, initial_guess: ArrayLike | None = None
    ) -> StepResult:
        """Return the optimal plan at step `k` from the measured `state` (n,), or the reason why there is none.

        The `states` and `inputs` of a `Plan` are nominal, and so are its cost and slack; its `input` is the one to
        apply, inside the given input set. `Infeasible` tells by how much the tightened sets would have to be widened,
        and how close to the reference a plan within them can end; its fallback is the first input of that plan.

        A plan is optimal up to a few 1e-9 of its cost if no bound is active (`Nearest`), and otherwise up to the
        accuracy of the interior-point method.

        The optimum needs no `initial_guess` (N, m). If the solver fails, the plan with these nominal inputs is used if
        it is admissible, with the status `KEPT`. On a robust reference the last plan, shifted by a step
        (`shifted_inputs`), is admissible, and its start is computed again. In directions that Aᴺ maps to zero in
        float64 the start may differ, and the plan may then cost more. Raises ValueError as `Controller.step`.
        """
        return answer_step(self, self._solve, self.formulation.admissible, (k, state, reference, initial_guess))

    def _solve(self, k: int, state: Array, window: Window, guess: Array | None) -> Plan | Infeasible:
        return TubeProblem.of(self.formulation, k, state, window).answer(guess)

    @cached_property
    def formulation(self) -> TubeFormulation:
        """The programs, built once for all steps."""
        return TubeFormulation(self.tightening.plant, self.horizon, self.Q, self.R, self.tightening)
