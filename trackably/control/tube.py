"""Tube model predictive control: a nominal plan on the reference, and a feedback that keeps the state near it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from trackably.arguments import instance
from trackably.arrays import ArrayLike
from trackably.certificates.certificate import bounds_text
from trackably.control.controller import Controller, described
from trackably.control.error_set import ErrorSet
from trackably.control.problem import Formulation
from trackably.systems.tightening import InvariantSet, Tightening


@dataclass(frozen=True, eq=False)
class TubeController(Controller):
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

    def __init__(
        self, tightening: Tightening, horizon: int, Q: ArrayLike | None = None, R: ArrayLike | None = None
    ) -> None:
        instance("tube: tightening", tightening, Tightening, "the tightening of a reference, or tightening(plant, W)")
        super().__init__(tightening.plant, horizon, Q, R)
        vars(self).update(tightening=tightening, plant=tightening.given)
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
        return ErrorSet.of(self.invariant)

    @cached_property
    def formulation(self) -> Formulation:
        """The parts of the problem that all steps share, with tightened sets and a free start z(0) ∈ x ⊕ (−Z)."""
        plant, inputs = self.tightening.plant, self.plant.input_set
        return Formulation(plant, self.horizon, self.Q, self.R, inputs, self.errors, self.invariant.feedback, 0)
