"""Tracking model predictive control with a terminal equality constraint on the reference."""

import operator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import eigvalsh

from trackable.arrays import Array
from trackable.control.followed import Followed
from trackable.control.step.answer import Answer
from trackable.control.step.sequential import by_linearisation
from trackable.control.step.task import TOLERANCE, Task
from trackable.control.step.tools import Tools
from trackable.systems.constrained import ConstrainedSystem

__all__ = ["TOLERANCE", "Controller"]


@dataclass(frozen=True, eq=False)
class Controller:
    """min Σ_(i<N) ‖x(k+i) − x_r(k+i)‖²_Q + ‖u(k+i) − u_r(k+i)‖²_R with x(k+N) = x_r(k+N), x ∈ X and u ∈ U.

    N is the `horizon` in steps, Q (n, n) is positive semidefinite and R (m, m) positive definite. The state at hand is
    not constrained, all later ones are. Raises ValueError where a weight is something else, and where N steps are too
    few to lead the system where the terminal constraint wants it; TypeError where N is no whole number.
    """

    plant: ConstrainedSystem
    horizon: int
    Q: Array
    R: Array

    def __post_init__(self) -> None:
        n, m = len(self.plant.system.states), len(self.plant.system.inputs)
        for name, size, least in (("Q", n, -1e-12), ("R", m, 1e-12)):
            weight = np.array(getattr(self, name), dtype=float)
            if weight.shape != (size, size) or not np.all(np.isfinite(weight)) or not np.array_equal(weight, weight.T):
                raise ValueError(
                    f"controller: {name} must be a symmetric matrix of shape ({size}, {size}), got {weight}"
                )
            values = eigvalsh(weight)
            if not values[0] >= least * max(values[-1], 0.0) or not values[-1] > 0:
                kind = "semidefinite and not zero" if least < 0 else "definite"
                raise ValueError(f"controller: {name} must be positive {kind}, got eigenvalues {values.tolist()}")
            weight.flags.writeable = False
            object.__setattr__(self, name, weight)
        object.__setattr__(self, "horizon", operator.index(self.horizon))
        if self.horizon < (fewest := max(self.plant.flatness.orders)):
            raise ValueError(
                f"controller: from a state off the reference it takes {fewest} steps to return to it, so that with a "
                f"terminal equality the horizon must be at least {fewest}, got {self.horizon}"
            )

    def step(self, k: int, state: Array, reference: Followed, guess: Array | None = None) -> Answer:
        """The optimal plan at step `k` from `state` (n,), or why there is none. ValueError for a state not finite.

        For a nonlinear system the optimum is sought near the inputs `guess` (N, m), such as the last plan's, shifted;
        left out, near the reference. A linear system has one optimum, and needs none.
        """
        state = np.asarray(state, dtype=float)
        if state.shape != (n := len(self.Q),) or not np.all(np.isfinite(state)):
            raise ValueError(f"controller: a state is {n} finite numbers, got {state.tolist()} at step {k}")
        window = reference.window(k, self.horizon)
        if self.tools.is_linear:
            return Task(self.tools, k, state, window, self.tools.model(window, window)).answer
        return by_linearisation(self.tools, k, state, window, guess)

    @cached_property
    def tools(self) -> Tools:
        """What is built once for all steps."""
        return Tools(self.plant, self.horizon, self.Q, self.R)
