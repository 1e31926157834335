"""Model predictive control that tracks a reference; each plan has to end exactly on it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from trackably.arguments import array, instance, whole
from trackably.arrays import Array, ArrayLike
from trackably.certificates.certificate import bounds_text
from trackably.control.bounds import weight_in_widths
from trackably.control.problem import TOLERANCE, Formulation, StepProblem
from trackably.control.references import unwrap_near
from trackably.control.search import solve_by_linearisation
from trackably.control.stepping import Infeasible, Plan, SteppedController
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Window

__all__ = ["TOLERANCE", "Controller"]

_ZERO = 1e-12
"""An eigenvalue of a weight counts as zero below this part of the largest one."""


@dataclass(frozen=True, eq=False)
class Controller(SteppedController):
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

    def _solve(self, k: int, state: Array, window: Window, initial_guess: Array | None) -> Plan | Infeasible:
        if self.formulation.is_linear:
            return StepProblem.of(self.formulation, k, state, window).answer
        return solve_by_linearisation(self.formulation, k, state, unwrap_near(self.plant, window, state), initial_guess)

    @cached_property
    def formulation(self) -> Formulation:
        """The parts of the problem that all steps share, each built once."""
        return Formulation(self.plant, self.horizon, self.Q, self.R, self.plant.input_set)


def _require_weight(name: str, given: ArrayLike | None, bounded: Polytope, least: float, kind: str) -> Array:
    """Return a weight of the cost, by default that of errors relative to the widths of the set.

    ValueError: it is not symmetric, or not positive `kind`. Its smallest eigenvalue is at least `least` times the
    largest, after the coordinates are scaled to a diagonal of ones, so that units do not matter.
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


def scaled_controller(plant: ConstrainedSystem, horizon: int, input_weight: float = 1.0) -> Controller:
    """Return a controller whose cost is the sum of squared errors, each divided by the width of its bounds.

    Errors of inputs are also multiplied by `input_weight`. Unbounded directions are weighted in their own unit. Raises
    as `Controller`.
    """
    return Controller(plant, horizon, R=input_weight * weight_in_widths(plant.input_set))
