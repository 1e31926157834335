"""Model predictive control that tracks a reference; each plan has to end exactly on it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from trackably.arguments import array, instance, numbers, whole
from trackably.arrays import Array, ArrayLike
from trackably.certificates.certificate import bounds_text
from trackably.control.bounds import pull_inside, weight_in_widths
from trackably.control.error_set import ErrorSet
from trackably.control.problem import TOLERANCE, Formulation, StepProblem
from trackably.control.references import TrackedReference, check_reference, check_window
from trackably.control.search import solve_by_linearisation
from trackably.control.stepping import StepResult, Unsolved
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Window

__all__ = ["TOLERANCE", "Controller"]

_ZERO = 1e-12
"""An eigenvalue of a weight counts as zero below this part of the largest one."""


@dataclass(frozen=True, eq=False)
class Controller:
    """min Σ_(i<N) ‖x(k+i) − x_r(k+i)‖²_Q + ‖u(k+i) − u_r(k+i)‖²_R with x(k+N) = x_r(k+N), x ∈ X and u ∈ U.

    N is the `horizon` in steps, Q (n, n) is positive semidefinite and R (m, m) positive definite. By default they
    weight errors relative to the widths of the sets, and unbounded directions in their own unit. The constraint x ∈ X
    holds for the predicted states, not for the current one. ValueError: Q or R is not such a matrix, or the horizon is
    shorter than the number of steps that the system needs to return to the reference. TypeError: the horizon is not an
    integer.
    """

    plant: ConstrainedSystem
    horizon: int
    Q: Array
    R: Array

    def __init__(
        self, plant: ConstrainedSystem, horizon: int, Q: ArrayLike | None = None, R: ArrayLike | None = None
    ) -> None:
        instance("controller: plant", plant, ConstrainedSystem, "a ConstrainedSystem(system, state_set, input_set)")
        if plant.moves and not isinstance(plant.system, LinearSystem):
            raise ValueError(
                "controller: bounds that move in time are possible for linear systems only, but f is nonlinear"
            )
        weights = {
            "Q": _require_weight("Q", Q, plant.state_set, -_ZERO, "semidefinite and not zero"),
            "R": _require_weight("R", R, plant.input_set, _ZERO, "definite"),
        }
        if whole("controller: horizon", horizon) < (fewest := shortest_horizon(plant)):
            raise ValueError(
                f"controller: from a state off the reference it takes {fewest} steps to return to it, so that with a "
                f"terminal equality the horizon must be at least {fewest}, got {horizon}"
            )
        vars(self).update(plant=plant, horizon=int(horizon), **weights)

    def __repr__(self) -> str:
        return f"Controller({described(self.plant, self.horizon)})"

    def step(
        self, k: int, state: ArrayLike, reference: TrackedReference, initial_guess: ArrayLike | None = None
    ) -> StepResult:
        """Return the optimal plan at step `k` from the measured `state` (n,), or the reason why there is none.

        For a nonlinear system the optimum is searched near the inputs `initial_guess` (N, m), by default near the
        reference. If this finds no plan, a few other trajectories are tried. The last plan, shifted by a step, is a
        good guess (`shifted_inputs`). Whole turns are added to the angles of the reference, so that they are near the
        state's. A linear system has one optimum and needs no guess. A step ends in one of these ways:

        - `Plan`: an optimal plan, for a nonlinear system a local optimum.
        - `Infeasible`: there is no plan; for a nonlinear system, none was found (`is_local`).
        - `Unsolved`: neither is known, because the numbers are beyond the solver or floating point, the search ends
          without an explanation, or a formula of the system or of the reference is undefined.
        - ValueError: the state is not n finite numbers, the guess is not (N, m), the reference is of another system, or
          it does not reach from step k to step k + N. TypeError: an argument is of another type.
        """
        plant, N = self.plant, self.horizon
        n, m = len(plant.system.states), len(plant.system.inputs)
        k, x = whole("controller: k", k), array(f"controller: state at step {k}", state, n)
        check_reference("controller", reference, plant)
        guess = None if initial_guess is None else numbers("controller: initial_guess", initial_guess)
        if guess is not None and guess.shape != (N, m):
            raise ValueError(f"controller: initial_guess must have shape {(N, m)}, got {guess.shape}")
        safe = () if guess is None else (guess[0],)
        try:
            with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # infinities and NaN are refused
                window = reference.window(k, N)
                check_window(window, (N, n, m))
                safe = (*safe, window.inputs[0])
                if not all(np.all(np.isfinite(values)) for values in window):
                    raise ArithmeticError("the reference has states or inputs in the horizon that are not finite")
                window = Window(plant.unwrap(window.states, x), window.inputs)
                problem = StepProblem(self.formulation, k, x, window, window)
                return problem.answer if self.formulation.is_linear else solve_by_linearisation(problem, guess)
        except (ArithmeticError, np.linalg.LinAlgError) as error:
            return Unsolved(k, str(error), _first_admissible(plant.input_set.at(k * plant.sampling_time), safe))

    @cached_property
    def formulation(self) -> Formulation:
        """The parts of the problem that all steps share, each built once.

        The measured state is not bounded, because no input changes it any more.
        """
        start, feedback = ErrorSet.zero(len(self.Q)), np.zeros((len(self.R), len(self.Q)))
        return Formulation(self.plant, self.horizon, self.Q, self.R, self.plant.input_set, start, feedback, 1)


def _first_admissible(input_set: Polytope, inputs: Iterable[Array]) -> Array:
    """Return the first of some inputs (m,) that is finite, pulled into the set; its centre if none is finite."""
    return next((pull_inside(input_set, u) for u in inputs if np.all(np.isfinite(u))), input_set.centre)


def _require_weight(name: str, given: ArrayLike | None, bounded: Polytope, least: float, kind: str) -> Array:
    """Return the weight matrix `given` of the cost; for None, that of errors relative to the widths of the set.

    ValueError: it is not symmetric, or not positive `kind`, which is "definite" or "semidefinite". This is decided by
    its smallest eigenvalue, which has to be at least `least` times the largest, after the coordinates are scaled to a
    diagonal of ones, so that units do not matter.
    """
    n = bounded.dimension
    weight = array(f"controller: {name}", weight_in_widths(bounded) if given is None else given, n, n)
    if not np.array_equal(weight, weight.T):
        raise ValueError(f"controller: {name} must be symmetric, got {weight.tolist()}")
    unit = np.sqrt(np.where(np.diag(weight) == 0, 1.0, np.abs(np.diag(weight))))
    values = scipy.linalg.eigvalsh(weight / unit[:, None] / unit)
    if not values[0] >= least * max(values[-1], 0.0) or not values[-1] > 0:
        found = scipy.linalg.eigvalsh(weight).tolist()
        raise ValueError(f"controller: {name} must be positive {kind}, got eigenvalues {found}")
    return weight


def described(plant: ConstrainedSystem, horizon: int) -> str:
    """Describe a controlled plant in one line: states, inputs, sampling time, horizon and bounds."""
    system = plant.system
    return (
        f"states {', '.join(system.states)}; inputs {', '.join(system.inputs)}; a step every {system.sampling_time:g} s"
        f"; horizon {horizon} steps; {bounds_text(plant.given_constraints) or 'no bounds'}"
    )


def shortest_horizon(plant: ConstrainedSystem) -> int:
    """Return the number of steps that a system needs to return to its reference: its largest order of a flat output."""
    return max(plant.flatness.orders)
