"""Results of a controller's step, and the functions that a simulation calls at each step."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

from trackably.arrays import Array
from trackably.systems.intervals import array_text
from trackably.systems.reference import Window

ROUNDING = 1e-12
"""A plan that violates a bound by no more than this part of the width counts as on the bound, because of rounding."""


class Status(StrEnum):
    """How a plan was found, and so whether it is an optimum or only admissible."""

    NO_ACTIVE_BOUND = "unbounded"
    """No bound is active: the optimum is linear in the error. Logs store "unbounded"."""
    SOLVED = "solved"
    """A bound is active: the optimum solves a quadratic program."""
    WIDENED = "widened"
    """Feasible only if all sets are widened, by less than the tolerance: the plan touches bounds, up to rounding."""
    KEPT = "kept"
    """The initial guess: for a nonlinear system, the search found no plan that costs less."""
    ADMISSIBLE = "admissible"
    """For a nonlinear system: an admissible plan at which the search for lower costs ended. Full steps
    (repeated linearisations) do not converge there, so that it is a minimum up to the accuracy of the search only."""

    @property
    def words(self) -> str:
        """The status in a few words, for explanations."""
        return _WORDS[self]


_WORDS = {
    Status.NO_ACTIVE_BOUND: "no bound is active",
    Status.SOLVED: "bounds are active",
    Status.WIDENED: "it touches bounds, up to rounding",
    Status.KEPT: "the initial guess",
    Status.ADMISSIBLE: "the search for lower costs did not converge",
}


@dataclass(frozen=True)
class Plan:
    """The optimal plan at step `k`. Apply `input` u(k) (m,), its first input.

    `states` x(k), …, x(k+N) (N + 1, n) and `inputs` u(k), …, u(k+N−1) (N, m) are predicted. `cost` is V = Σ_(i<N) ‖x −
    x_r‖²_Q + ‖u − u_r‖²_R along them, and `stage_cost` is its first term. `slack` is the smallest distance to a bound,
    relative to the width between the bounds; it is at least minus twice the controller's tolerance. `terminal_residual`
    is max |x(k+N) − x_r(k+N)|, zero up to the solver's accuracy.
    """

    k: int
    input: Array
    cost: float
    stage_cost: float
    states: Array
    inputs: Array
    slack: float
    terminal_residual: float
    status: Status

    @property
    def trajectory(self) -> Window:
        """The predicted states and inputs."""
        return Window(self.states, self.inputs)

    @property
    def keeps_sets(self) -> bool:
        """Whether the plan stays in the sets up to rounding (1e-12 of a width), not only up to the controller's
        tolerance."""
        return self.slack >= -ROUNDING

    @property
    def explanation(self) -> str:
        """One sentence: how the plan was found, its cost, and its slack."""
        return (
            f"at step {self.k} feasible ({self.status.words}), V = {self.cost:.4g}, slack {self.slack:.3g} of a width"
        )

    def __repr__(self) -> str:
        return f"Plan({self.explanation}; input {array_text(self.input)})"


@dataclass(frozen=True)
class Infeasible:
    """The reason why no admissible plan ends on the reference at step `k`: there is none, or none was found.

    If the answer `is_local`, none was found: plans of a nonlinear system are searched from a few trajectories only. The
    following then holds for the linearisation at which a search ended.

    `widening` is the least part of their widths by which all sets must be widened so that a plan exists. In that plan
    `quantity` reaches its widened bound first, at step `at_step`, where it is `excess` (in its own unit) outside its
    set.

    Without widening, `terminal_error` (n,) is x(k+N) − x_r(k+N) of the plan that ends closest to the reference (each
    state in the scale of its set). Of the plans with that end, `fallback` (m,) is the first input of the cheapest. If
    no plan within the sets is found, `terminal_error` is None, and `fallback` is the first input of the cheapest
    plan in the widened sets, pulled into the input set.
    """

    k: int
    widening: float
    quantity: str
    at_step: int
    excess: float
    terminal_error: Array | None
    fallback: Array
    is_local: bool

    @property
    def explanation(self) -> str:
        """One sentence: the least widening with which a plan exists, and the least terminal error without widening."""
        if self.terminal_error is None:
            missed = "no plan that keeps them was found"
        else:
            missed = f"a plan that keeps them misses the reference by {abs(self.terminal_error).max():.3g}"
        none = "no plan was found that ends" if self.is_local else "no plan ends"
        return (
            f"at step {self.k} {none} on the reference: all bounds would have to move by {self.widening:.3g} of "
            f"their widths, and the {self.quantity} by {self.excess:.3g} at step {self.at_step}; {missed}"
        )

    def __repr__(self) -> str:
        return f"Infeasible({self.explanation}; fallback {array_text(self.fallback)})"


@dataclass(frozen=True)
class Unsolved:
    """The reason why step `k` has no answer: no plan was found, and it is not known that there is none.

    The numbers are beyond the solver or overflow, a search did not converge, or a formula of the system is undefined at
    a state or an input that was tried.
    `fallback` (m,) is the first input of the initial guess, or of the reference if the guess has none that is finite,
    pulled into the input set; failing both, it is the centre of the set.
    """

    k: int
    reason: str
    fallback: Array

    @property
    def explanation(self) -> str:
        """One sentence: why there is no answer."""
        return f"at step {self.k} no answer: {self.reason}"

    def __repr__(self) -> str:
        return f"Unsolved({self.explanation}; fallback {array_text(self.fallback)})"


StepResult = Plan | Infeasible | Unsolved


Successor = Callable[[int, Array, Array], Array]
"""A plant, which may differ from the controller's model: returns x(k + 1) (n,) from k, x(k) (n,) and u(k) (m,)."""

Disturbances = Callable[[int, Array], Array]
"""Returns the disturbance w(k) (n,) to be added to x(k + 1), from k and the undisturbed x(k + 1).

As a noise of measurement, it returns v(k) to be added to x(k), from k and x(k).
"""
