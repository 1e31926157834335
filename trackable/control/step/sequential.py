"""One step of a nonlinear system: a sequence of convex programs, each linearised along the plan before it."""

import numpy as np

from trackable.arrays import Array
from trackable.control.step.error_model import reference_defects
from trackable.control.step.formulation import Formulation
from trackable.control.step.problem import StepProblem
from trackable.control.step.result import Plan, Status, StepResult
from trackable.systems.constrained import System
from trackable.systems.reference import Window

MAX_LINEARISATIONS = 50
"""A sequence that has not converged by then does not converge."""

_CONVERGED = 1e-12
"""The system follows a plan up to this part of its size. Convergence is quadratic: plans then differ by about 1e-6."""


def solve_by_linearisation(
    formulation: Formulation, k: int, state: Array, window: Window, initial_guess: Array | None
) -> StepResult:
    """Solve step `k` by sequential linearisation, from the inputs `initial_guess` (N, m) or from the reference.

    The result is local: a minimum, or a reason for infeasibility, among the plans near by. If the initial guess is
    admissible and costs less than the plan found, it is returned instead. With the shifted last plan as the guess,
    feasibility is thus never lost and the cost never rises, whatever the sequence converges to. Raises ArithmeticError
    where the sequence does not converge, or where the system is not defined along a plan.
    """
    system = formulation.plant.system
    nominal = window if initial_guess is None else apply_inputs(system, state, initial_guess)
    problem = _linearised(formulation, k, state, window, nominal)
    kept = None if initial_guess is None else problem.plan(initial_guess - window.inputs, Status.KEPT)
    if kept is not None and not problem.is_feasible(kept):
        kept = None
    for _ in range(MAX_LINEARISATIONS):
        result = problem.result
        plan = result if isinstance(result, Plan) else problem.widest
        nominal = Window(plan.states, plan.inputs)
        if _defect(system, nominal) <= _CONVERGED * max(1.0, float(np.max(np.abs(nominal.states)))):
            return result if kept is None or (isinstance(result, Plan) and result.cost <= kept.cost) else kept
        problem = _linearised(formulation, k, state, window, nominal)
    if kept is None:
        raise ArithmeticError(f"controller: at step {k} no convergence after {MAX_LINEARISATIONS} linearisations")
    return kept


def apply_inputs(system: System, state: Array, inputs: Array) -> Window:
    """Simulate the system from `state` (n,) under `inputs` (N, m)."""
    states = [state]
    for u in inputs:
        states.append(system.successor(states[-1], u))
    return Window(np.array(states), inputs)


def _linearised(formulation: Formulation, k: int, state: Array, window: Window, nominal: Window) -> StepProblem:
    model = formulation.local_model(window, nominal)
    if not all(np.all(np.isfinite(part)) for part in (model.error_model.A, model.error_model.B, model.defects)):
        raise ArithmeticError(f"controller: at step {k} a plan leads where the system is not defined")
    return StepProblem(formulation, k, state, window, model)


def _defect(system: System, plan: Window) -> float:
    """Return the largest difference between a plan's states and those that the system reaches."""
    return float(np.max(np.abs(reference_defects(system, plan))))
