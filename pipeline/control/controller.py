"""Tracking model predictive control with a terminal equality constraint on the reference."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import eigvalsh

from pipeline.arrays import Array
from pipeline.control.admissible import Admissible
from pipeline.control.answer import Answer, Infeasible, Status, Step
from pipeline.control.followed import Followed
from pipeline.control.prediction import Prediction, gaps
from pipeline.control.program import Program, closest, tracking, widening
from pipeline.control.room import Room, Sets
from pipeline.control.unbounded import Unbounded
from pipeline.systems.constrained import ConstrainedSystem
from pipeline.systems.reference import Window

TOLERANCE = 1e-7
"""A step counts as feasible if it is with every set widened by this part of its width.

On a reference that touches its bounds a plan has no room at all, and a state that has followed the last plan is off it
by rounding and by what the solver calls equal: without a tolerance such a step would be lost. A certified reference
itself keeps its bounds without any.
"""


@dataclass(frozen=True, eq=False)
class Controller:
    """min Σ_(i<N) ‖x(k+i) − x_r(k+i)‖²_Q + ‖u(k+i) − u_r(k+i)‖²_R with x(k+N) = x_r(k+N), x ∈ X and u ∈ U.

    N is the `horizon` in steps, Q (n, n) is positive semidefinite and R (m, m) positive definite. The state at hand is
    not constrained, all later ones are. Raises ValueError where a weight is something else, and where N steps are too
    few to lead the system where the terminal constraint wants it.
    """

    plant: ConstrainedSystem
    horizon: int
    Q: Array
    R: Array

    def __post_init__(self) -> None:
        n, m = self.plant.system.B.shape
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
        if self.horizon < (fewest := max(self.plant.flatness.orders)):
            raise ValueError(
                f"controller: from a state off the reference it takes {fewest} steps to return to it, so that with a "
                f"terminal equality the horizon must be at least {fewest}, got {self.horizon}"
            )

    def step(self, k: int, state: Array, reference: Followed) -> Answer:
        """The optimal plan at step `k` from `state` (n,), or why there is none. ValueError for a state not finite."""
        state = np.asarray(state, dtype=float)
        if state.shape != (n := len(self.plant.system.A),) or not np.all(np.isfinite(state)):
            raise ValueError(f"controller: a state is {n} finite numbers, got {state.tolist()} at step {k}")
        task = _Task(self, k, state, reference.window(k, self.horizon))
        return task.unbounded() or task.solved() or task.widened_or_infeasible()

    @cached_property
    def prediction(self) -> Prediction:
        """How errors evolve along any reference: of a linear system, the same everywhere."""
        return Prediction.of(self.plant.system, self.horizon)

    @cached_property
    def sets(self) -> Sets:
        return Sets.of(self.plant)

    @cached_property
    def unbounded(self) -> Unbounded:
        return Unbounded(self.prediction, self.Q, self.R)

    @cached_property
    def tracking(self) -> Program:
        return tracking(self.plant, self.horizon, self.Q, self.R)

    @cached_property
    def widening(self) -> Program:
        return widening(self.plant, self.horizon)

    @cached_property
    def closest(self) -> Program:
        return closest(self.plant, self.horizon)

    @cached_property
    def admissible(self) -> Admissible:
        return Admissible(self.plant.input_set)


@dataclass(frozen=True, eq=False)
class _Task:
    """One step: where the system is, and what lies ahead."""

    controller: Controller
    k: int
    state: Array
    window: Window

    @cached_property
    def start(self) -> Array:
        return np.asarray(self.state - self.window.states[0])

    @cached_property
    def gaps(self) -> Array:
        return gaps(self.controller.plant.system, self.window)

    @cached_property
    def room(self) -> Room:
        return Room.around(self.controller.sets, self.window)

    def unbounded(self) -> Step | None:
        """The optimum without bounds, if it keeps them."""
        unforced = self.controller.prediction.unforced(self.start, self.gaps)
        found = self._following(self.controller.unbounded.inputs(unforced), Status.UNBOUNDED)
        return found if found.slack >= 0 else None

    def solved(self) -> Step | None:
        """The optimum, if the solver finds it."""
        return self._optimum(self.room, Status.SOLVED)

    def widened_or_infeasible(self) -> Answer:
        """By how much the sets would have to be widened, and the optimum in spite of it where that is next to nothing.

        Raises ArithmeticError where the solver fails at a question that has an answer.
        """
        plan = self._plan(self.controller.widening, self.room)
        if plan is None:
            raise ArithmeticError(f"controller: the numbers of step {self.k} are beyond the solver")
        widest = self._following(plan, Status.WIDENED)
        if -widest.slack > TOLERANCE:
            return self._infeasible(widest)
        optimum = self._optimum(self.room.widened(self.controller.sets, TOLERANCE), Status.WIDENED)
        return optimum or widest

    def _optimum(self, room: Room, status: Status) -> Step | None:
        plan = self._plan(self.controller.tracking, room)
        if plan is None:
            return None
        found = self._following(plan, status)
        lands = found.landing <= TOLERANCE * max(1.0, float(np.max(np.abs(found.states))))
        return found if lands and found.slack >= -2 * TOLERANCE else None

    def _plan(self, program: Program, room: Room) -> Array | None:
        return program.plan(self.controller.prediction, self.start, self.gaps, room)

    def _following(self, v: Array, status: Status) -> Step:
        """The plan with input errors v (N, m)."""
        controller = self.controller
        errors = controller.prediction.errors(self.start, v, self.gaps)
        e = np.vstack([self.start, errors])
        stages = np.einsum("ia,ab,ib->i", e[:-1], controller.Q, e[:-1]) + np.einsum("ia,ab,ib->i", v, controller.R, v)
        return Step(
            k=self.k,
            input=controller.admissible.nearest(self.window.inputs[0] + v[0]),
            cost=float(np.sum(stages)),
            stage_cost=float(stages[0]),
            states=self.window.states + e,
            inputs=self.window.inputs + v,
            slack=self.room.left(controller.sets, errors, v).least,
            landing=float(np.max(np.abs(errors[-1]))),
            status=status,
        )

    def _infeasible(self, widest: Step) -> Infeasible:
        """How far the sets are from a plan, and the plans that come closest."""
        controller, plant = self.controller, self.controller.plant
        errors, v = widest.states[1:] - self.window.states[1:], widest.inputs - self.window.inputs
        quantity, steps_ahead = self.room.left(controller.sets, errors, v).tightest
        closest = self._plan(controller.closest, self.room.widened(controller.sets, TOLERANCE))
        reached = None if closest is None else self._following(closest, Status.WIDENED)
        return Infeasible(
            k=self.k,
            widening=-widest.slack,
            quantity=plant.quantities[quantity].name,
            when=self.k + steps_ahead,
            excess=-widest.slack * plant.quantities[quantity].bounds.width,
            miss=None if reached is None else reached.states[-1] - self.window.states[-1],
            fallback=(reached or widest).input,
        )
