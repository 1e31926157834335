"""Tube model predictive control that tracks a reference under disturbances."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from trackably.arguments import instance
from trackably.arrays import Array, ArrayLike
from trackably.control.controller import Controller
from trackably.control.references import TrackedReference, check_window
from trackably.control.step.result import Infeasible, Plan, StepResult, Unsolved
from trackably.control.stepping import StepArguments
from trackably.control.tube.error_set import ErrorSet
from trackably.control.tube.formulation import TubeFormulation
from trackably.control.tube.problem import TubeProblem
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.disturbance.invariant import InvariantSet
from trackably.systems.disturbance.tightening import Tightening
from trackably.systems.reference import Window


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
