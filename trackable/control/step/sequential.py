"""One step of a nonlinear system: convex programs of linearisations, each near the plan that the last one found."""

import numpy as np

from trackable.arrays import Array
from trackable.control.step.answer import Answer, Status, Step
from trackable.control.step.prediction import gaps
from trackable.control.step.task import Task
from trackable.control.step.tools import Tools
from trackable.systems.constrained import System
from trackable.systems.reference import Window

ROUNDS = 50
"""A plan that has not settled by then will not."""

_SETTLED = 1e-12
"""The system follows a plan to this part of its size. As the rest is quadratic, plans have then moved by 1e-6."""


def by_linearisation(tools: Tools, k: int, state: Array, window: Window, guess: Array | None) -> Answer:
    """The plan at step `k` that a search from the inputs `guess` (N, m), or from the reference, ends with.

    A minimum, or a reason for infeasibility, is one among plans near by. Where the guess itself is admissible and costs
    less than what was found, it stays: with the last plan, continued with the reference's own input, feasibility is
    never lost and the cost never rises, wherever the search ends. Raises ArithmeticError where it ends nowhere, or the
    system is not defined along a plan.
    """
    plan = window if guess is None else rolled_out(tools.plant.system, state, guess)
    task = _near(tools, k, state, window, plan)
    kept = None if guess is None else task.following(guess - window.inputs, Status.KEPT)
    if kept is not None and not task.holds(kept):
        kept = None
    for _ in range(ROUNDS):
        answer = task.answer
        found = answer if isinstance(answer, Step) else task.widest
        plan = Window(found.states, found.inputs)
        if _defect(tools.plant.system, plan) <= _SETTLED * max(1.0, float(np.max(np.abs(plan.states)))):
            return answer if kept is None or (isinstance(answer, Step) and answer.cost <= kept.cost) else kept
        task = _near(tools, k, state, window, plan)
    if kept is None:
        raise ArithmeticError(f"controller: at step {k} plans had not settled after {ROUNDS} linearisations")
    return kept


def rolled_out(system: System, state: Array, inputs: Array) -> Window:
    """Where `inputs` (N, m) take the system from `state` (n,)."""
    states = [state]
    for u in inputs:
        states.append(system.successor(states[-1], u))
    return Window(np.array(states), inputs)


def _near(tools: Tools, k: int, state: Array, window: Window, plan: Window) -> Task:
    model = tools.model(window, plan)
    if not all(np.all(np.isfinite(part)) for part in (model.prediction.A, model.prediction.B, model.gaps)):
        raise ArithmeticError(f"controller: at step {k} a plan leads where the system is not defined")
    return Task(tools, k, state, window, model)


def _defect(system: System, plan: Window) -> float:
    """How far a plan is from what the system does."""
    return float(np.max(np.abs(gaps(system, plan))))
