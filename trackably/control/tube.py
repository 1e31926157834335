"""Tube model predictive control: a nominal plan on the reference, and a feedback that keeps the state near it."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.optimize import lsq_linear

from trackably.arguments import instance
from trackably.arrays import Array, ArrayLike
from trackably.certificates.certificate import bounds_text
from trackably.control.controller import Controller, described
from trackably.control.problem import Formulation, StepProblem
from trackably.control.programs import StartSet
from trackably.control.stepping import ROUNDING, Infeasible, Plan, Status, SteppedController
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.disturbances import Zonotope
from trackably.systems.reference import Window
from trackably.systems.tightening import InvariantSet, Tightening

# The invariant set of the error in float64.

_ROUNDING = 1e-10
"""A point counts as in Z if it is off a point of Z by no more than this part of the width of Z along each axis."""

_CONVERGED = 1e-15  # tolerance of SciPy's search for the least squares


@dataclass(frozen=True, eq=False)
class ErrorSet:
    """The set Z = ⊕_{i<N} A_Kⁱ W ⊕ A_Kᴺ (1 − α)⁻¹ ⊕_{i<s} A_Kⁱ P of an `InvariantSet`, which defines N, α, s and P.

    A_K is the closed loop, W the disturbance set and P a box. In float64, Z is the sum of `centre`, the zonotope
    {Σ_j ξ_j g_j : |ξ_j| ≤ 1} and the convex hulls `hulls`. If W is a zonotope, there are no hulls. If W is a convex
    hull, each A_Kⁱ W is one of the hulls, and the generators g_j are those of the sum over P. So each point of Z is
    `centre` + p · `directions` for some p (q,) with `lower` ≤ p ≤ 1 and `sums` p = 1: p are multiples of the generators
    and shares of the vertices of each hull.
    """

    invariant: InvariantSet

    @property
    def dimension(self) -> int:
        return len(self.invariant.box)

    def contains(self, e: Array) -> bool:
        """Whether an error e (n,) is in Z, up to rounding: whether `centre` + p · `directions` = e for an admissible p.

        p is found by least squares, within its bounds.
        """
        rows = np.vstack([self.directions.T / self.extents[:, None], self.sums])
        aim = np.append((e - self.centre) / self.extents, np.ones(len(self.sums)))
        found = lsq_linear(rows, aim, (self.lower, np.ones_like(self.lower)), method="bvls", tol=_CONVERGED)
        return bool(np.all(np.abs(found.fun) <= _ROUNDING))

    @cached_property
    def directions(self) -> Array:
        """The generators of Z, then the vertices of all its convex hulls: shape (q, n)."""
        return np.vstack([self.generators, self.hulls.reshape(-1, self.dimension)])

    @cached_property
    def lower(self) -> Array:
        """The lower bounds of p (q,) in Z = {`centre` + p · `directions`}: −1 for a generator, and 0 for a vertex."""
        return np.repeat([-1.0, 0.0], [len(self.generators), len(self.directions) - len(self.generators)])

    @cached_property
    def sums(self) -> Array:
        """The 0–1 matrix (N, q) in `sums` p = 1, a condition in Z = {`centre` + p · `directions`}; empty without hulls.

        Row i selects the vertices of hull i: their coefficients p_j ≥ 0 add up to 1, a convex combination.
        """
        N, v, _ = self.hulls.shape
        return np.hstack([np.zeros((N, len(self.generators))), np.kron(np.eye(N), np.ones(v))])

    def support(self, rows: Array) -> Array:
        """Return h_Z(row) for rows (…, n); the result has shape (…)."""
        of_hulls = np.einsum("...n,ivn->...iv", rows, self.hulls).max(axis=-1).sum(axis=-1)
        return np.asarray(rows @ self.centre + np.abs(rows @ self.generators.T).sum(axis=-1) + of_hulls)

    @cached_property
    def extents(self) -> Array:
        """The width of Z along each axis (n,); 1 if it is zero."""
        axes = np.eye(self.dimension)
        reach = self.support(axes) + self.support(-axes)
        return np.where(reach > 0, reach, 1.0)

    @property
    def centre(self) -> Array:
        """The centre of Z (n,): the sum over i < N of the centre of A_Kⁱ W, or of its vertices' mean if W is a hull."""
        centres = self._head[:, 0] if self._is_zonotope else self._head.mean(axis=1)
        return np.asarray(centres.sum(axis=0))

    @cached_property
    def generators(self) -> Array:
        """The generators g_j of the zonotope in Z, one in each row (g, n), without those that are zero."""
        Z = self.invariant
        tail = self._images(np.diag(Z.box) / (1 - Z.contraction), Z.head + Z.terms)[Z.head :]
        of_head = self._head[:, 1:] if self._is_zonotope else self._head[:0]
        stacked = np.vstack([of.reshape(-1, self.dimension) for of in (of_head, tail)])
        return stacked[np.any(stacked != 0, axis=1)]

    @cached_property
    def hulls(self) -> Array:
        """The v vertices of each hull A_Kⁱ W, i < N, minus their mean: (N, v, n); (0, v, n) if W is a zonotope."""
        found = np.asarray(self._head - self._head.mean(axis=1, keepdims=True))
        return found[:0] if self._is_zonotope else found

    @property
    def _is_zonotope(self) -> bool:
        return isinstance(self.invariant.disturbance, Zonotope)

    @cached_property
    def _head(self) -> Array:
        """A_Kⁱ W for i < N, each by v vectors: its centre and generators, or its vertices; shape (N, v, n)."""
        return self._images(self.invariant.disturbance.matrix, self.invariant.head)

    def _images(self, vectors: Array, count: int) -> Array:
        """Return A_Kⁱ applied to each of the `vectors` (v, n), for i < `count`: shape (count, v, n)."""
        found = [vectors]
        while len(found) < count:
            found.append(found[-1] @ self.invariant.closed_loop.T)
        return np.array(found)


@dataclass(frozen=True, eq=False)
class TubeFormulation(Formulation):
    """The parts of the problem that all steps share: tightened sets, and a free start z(0) with x ∈ z(0) ⊕ Z.

    `errors` is Z. The sets of `plant` are tightened, and `input_set` is not.
    """

    errors: ErrorSet

    @cached_property
    def start(self) -> StartSet:
        """The set of nominal start states z(0), divided by the states' scales: x − z(0) ∈ Z."""
        Z, scales = self.errors, self.scales.states
        return StartSet(Z.centre / scales, Z.directions / scales, Z.lower, Z.sums, 0)

    @property
    def feedback(self) -> Array:
        """The feedback K (m, n), which keeps the error x − z in Z."""
        return self.errors.invariant.feedback


@dataclass(frozen=True, eq=False)
class TubeProblem(StepProblem):
    """A `StepProblem` whose plan starts from any nominal state z(0) with x ∈ z(0) ⊕ Z.

    Most steps need no quadratic program, because the reference itself is the plan while the state is in the tube.
    """

    formulation: TubeFormulation

    def without_bounds(self) -> Plan | None:
        """Return the reference itself as the plan, if the state is in the tube around it."""
        if not self.formulation.errors.contains(self.off):
            return None
        plan = self.plan_with(self.window.inputs, Status.NO_ACTIVE_BOUND, self.window.states[0])
        return plan if plan.slack >= -ROUNDING and self.ends_on_reference(plan) else None


@dataclass(frozen=True, eq=False)
class TubeController(SteppedController):
    """min Σ_(i<N) ‖z(i) − x_r(k+i)‖²_Q + ‖v(i) − u_r(k+i)‖²_R with x ∈ z(0) ⊕ Z, z(N) = x_r(k+N) and tightened bounds.

    The nominal z(i+1) = A z(i) + B v(i) + c stays in the sets of `tightening.plant`, z(0) is free in x ⊖ Z, and the
    input applied is u = v(0) + K (x − z(0)). As long as disturbances are in W (Mayne, Seron, Raković 2005: Robust model
    predictive control of constrained linear systems with bounded disturbances, Automatica 41):

    - States and inputs satisfy the given bounds, as x ∈ z(0) ⊕ Z.
    - Feasibility is never lost on a robust reference: the plan, shifted by a step and continued with the reference's
      own input, is a plan for the next state, because x⁺ − z(1) = (A + B K) (x − z(0)) + w ∈ Z.
    - So V(k+1) ≤ V(k) − ℓ(k), and the nominal state tends to the reference: x is led into x_r ⊕ Z, where V = 0.

    The `states` and `inputs` of a `Plan` are nominal, and so are its cost and slack; its `input` is the one to apply,
    inside the given input set. It is optimal up to the accuracy of the interior-point method. `Infeasible` tells by how
    much the tightened sets would have to be widened, and how close to the reference a plan within them can end; its
    fallback is the first input of that plan.

    By default, weights are those of `Controller` for the tightened sets. Raises ValueError and TypeError as
    `Controller`, and ValueError without a disturbance.
    """

    tightening: Tightening
    horizon: int
    Q: Array
    R: Array
    plant: ConstrainedSystem = field(init=False)
    """The system with its given sets, in which states and inputs stay."""

    def __init__(
        self, tightening: Tightening, horizon: int, Q: ArrayLike | None = None, R: ArrayLike | None = None
    ) -> None:
        instance("tube: tightening", tightening, Tightening, "the tightening of a reference, or tightening(plant, W)")
        nominal = Controller(tightening.plant, horizon, Q, R)
        vars(self).update(tightening=tightening, plant=tightening.given)
        vars(self).update(horizon=nominal.horizon, Q=nominal.Q, R=nominal.R)
        _ = self.errors  # computed here, so that a missing disturbance set is refused now

    def __repr__(self) -> str:
        tightened = bounds_text(self.tightening.plant.given_constraints)
        return f"TubeController({described(self.plant, self.horizon)}; plans keep {tightened})"

    @property
    def invariant(self) -> InvariantSet:
        """The invariant set Z of the error, with the feedback K."""
        if self.tightening.invariant is None:
            raise ValueError("tube: expected a tightening for a disturbance set, got one without; use Controller then")
        return self.tightening.invariant

    @cached_property
    def errors(self) -> ErrorSet:
        """The invariant set Z in float64."""
        return ErrorSet(self.invariant)

    def _solve(self, k: int, state: Array, window: Window, _: Array | None) -> Plan | Infeasible:
        return TubeProblem.of(self.formulation, k, state, window).answer

    @cached_property
    def formulation(self) -> TubeFormulation:
        """The parts of the problem that all steps share, each computed on first use."""
        plant, inputs = self.tightening.plant, self.plant.input_set
        return TubeFormulation(plant, self.horizon, self.Q, self.R, inputs, self.errors)
