"""One step of a controller: the optimum of its convex program, or how far the sets are from one."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from trackable.arrays import Array
from trackable.control.step.answer import Answer, Infeasible, Status, Step
from trackable.control.step.program import Program
from trackable.control.step.room import Room
from trackable.control.step.tools import Model, Tools
from trackable.systems.reference import Window

TOLERANCE = 1e-7
"""A step counts as feasible if it is with every set widened by this part of its width.

On a reference that touches its bounds a plan has no room at all, and a state that has followed the last plan is off it
by rounding and by what the solver calls equal: without a tolerance such a step would be lost. A certified reference
itself keeps its bounds without any.
"""

_ROUNDING = 1e-12
"""What is off by no more than this part of a width is on its bound: on a reference at rest there, the optimum is."""


@dataclass(frozen=True, eq=False)
class Task:
    """One step: where the system is, what lies ahead, and the model of it."""

    tools: Tools
    k: int
    state: Array
    window: Window
    model: Model

    @cached_property
    def answer(self) -> Answer:
        """The optimal plan, or why there is none."""
        return self.unbounded() or self.solved() or self.widened_or_infeasible()

    @cached_property
    def start(self) -> Array:
        return np.asarray(self.state - self.window.states[0])

    @cached_property
    def room(self) -> Room:
        return Room.around(self.tools.sets, self.window)

    def unbounded(self) -> Step | None:
        """The optimum without bounds, if it keeps them."""
        unforced = self.model.prediction.unforced(self.start, self.model.gaps)
        found = self.following(self.model.unbounded.inputs(unforced), Status.UNBOUNDED)
        return found if found.slack >= -_ROUNDING else None

    def solved(self) -> Step | None:
        """The optimum, if the solver finds it."""
        return self._optimum(self.room, Status.SOLVED)

    def widened_or_infeasible(self) -> Answer:
        """By how much the sets would have to be widened, and the optimum in spite of it where that is next to nothing.

        Raises as `widest`.
        """
        if -self.widest.slack > TOLERANCE:
            return self._infeasible(self.widest)
        optimum = self._optimum(self.room.widened(self.tools.sets, TOLERANCE), Status.WIDENED)
        return optimum or self.widest

    @cached_property
    def widest(self) -> Step:
        """The plan that needs the sets widened least, or leaves most room in them.

        Raises ArithmeticError where the solver fails at a question that has an answer.
        """
        plan = self._plan(self.tools.widening, self.room)
        if plan is None:
            raise ArithmeticError(f"controller: the numbers of step {self.k} are beyond the solver")
        return self.following(plan, Status.WIDENED)

    def holds(self, found: Step) -> bool:
        """Whether a plan ends on the reference and keeps the sets, to twice the tolerance."""
        lands = found.landing <= TOLERANCE * max(1.0, float(np.max(np.abs(found.states))))
        return lands and found.slack >= -2 * TOLERANCE

    def _optimum(self, room: Room, status: Status) -> Step | None:
        plan = self._plan(self.tools.tracking, room)
        if plan is None:
            return None
        found = self.following(plan, status)
        return found if self.holds(found) else None

    def _plan(self, program: Program, room: Room) -> Array | None:
        return program.plan(self.model.prediction, self.start, self.model.gaps, room)

    def following(self, v: Array, status: Status) -> Step:
        """The plan with input errors v (N, m)."""
        tools = self.tools
        errors = self.model.prediction.errors(self.start, v, self.model.gaps)
        e = np.vstack([self.start, errors])
        stages = np.einsum("ia,ab,ib->i", e[:-1], tools.Q, e[:-1]) + np.einsum("ia,ab,ib->i", v, tools.R, v)
        return Step(
            k=self.k,
            input=tools.admissible.nearest(self.window.inputs[0] + v[0]),
            cost=float(np.sum(stages)),
            stage_cost=float(stages[0]),
            states=self.window.states + e,
            inputs=self.window.inputs + v,
            slack=self.room.left(tools.sets, errors, v).least,
            landing=float(np.max(np.abs(errors[-1]))),
            status=status,
        )

    def _infeasible(self, widest: Step) -> Infeasible:
        """How far the sets are from a plan, and the plans that come closest."""
        tools, plant = self.tools, self.tools.plant
        errors, v = widest.states[1:] - self.window.states[1:], widest.inputs - self.window.inputs
        quantity, steps_ahead = self.room.left(tools.sets, errors, v).tightest
        closest = self._plan(tools.closest, self.room.widened(tools.sets, TOLERANCE))
        reached = None if closest is None else self.following(closest, Status.WIDENED)
        return Infeasible(
            k=self.k,
            widening=-widest.slack,
            quantity=plant.given_constraints[quantity].name,
            when=self.k + steps_ahead,
            excess=-widest.slack * plant.given_constraints[quantity].bounds.width,
            miss=None if reached is None else reached.states[-1] - self.window.states[-1],
            fallback=(reached or widest).input,
        )
