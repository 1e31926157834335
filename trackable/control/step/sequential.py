"""One step of a nonlinear system: a sequence of convex programs, each linearised along the plan before it."""

import numpy as np

from trackable.arrays import Array
from trackable.control.step.error_model import reference_defects
from trackable.control.step.formulation import Formulation
from trackable.control.step.problem import StepProblem
from trackable.control.step.result import Infeasible, Plan, Status
from trackable.systems.constrained import System
from trackable.systems.reference import Window

MAX_LINEARISATIONS = 50
"""A sequence that has not converged by then does not converge."""

_CONVERGED = 1e-12
"""The system follows a plan up to this part of its scales. Convergence is quadratic: plans then differ by about
1e-6."""


def solve_by_linearisation(
    formulation: Formulation, k: int, state: Array, window: Window, initial_guess: Array | None
) -> Plan | Infeasible:
    """Solve step `k` by sequential linearisation, from the inputs `initial_guess` (N, m) or from the reference.

    The result is local: a minimum, or a reason for infeasibility, among the plans near by. If the initial guess is
    admissible and costs less than the plan found, or none is found, it is returned instead. With the shifted last plan
    as the guess, feasibility is thus never lost and the cost never rises, whatever the sequence converges to. Raises
    ArithmeticError where the sequence does not converge, where the system is not defined along a plan, and where the
    numbers are beyond the solver.
    """
    system = formulation.plant.system
    nominal = window if initial_guess is None else apply_inputs(system, state, initial_guess)
    problem = _linearised(formulation, k, state, window, nominal)
    kept = None if initial_guess is None else problem.plan(initial_guess - window.inputs, Status.KEPT)
    if kept is None or not problem.is_feasible(kept):
        return _converged(problem)
    try:
        result = _converged(problem)
    except (ArithmeticError, np.linalg.LinAlgError):
        return kept
    return result if isinstance(result, Plan) and result.cost <= kept.cost else kept


def _converged(problem: StepProblem) -> Plan | Infeasible:
    """Return the result of the last of a sequence of problems, each linearised along the plan of the one before."""
    formulation = problem.formulation
    for _ in range(MAX_LINEARISATIONS):
        plan = problem.optimum or problem.widest
        nominal = Window(plan.states, plan.inputs)
        if _is_followed(formulation, nominal):
            return problem.optimum or problem.infeasible
        problem = _linearised(formulation, problem.k, problem.state, problem.window, nominal)
    raise ArithmeticError(f"no convergence after {MAX_LINEARISATIONS} linearisations")


def apply_inputs(system: System, state: Array, inputs: Array) -> Window:
    """Simulate the system from `state` (n,) under `inputs` (N, m)."""
    states = [state]
    for u in inputs:
        states.append(system.successor(states[-1], u))
    return Window(np.array(states), inputs)


def _linearised(formulation: Formulation, k: int, state: Array, window: Window, nominal: Window) -> StepProblem:
    model = formulation.local_model(window, nominal)
    if not all(np.all(np.isfinite(part)) for part in (model.error_model.A, model.error_model.B, model.defects)):
        raise ArithmeticError("a plan leads where the system is not defined")
    return StepProblem(formulation, k, state, window, model)


def _is_followed(formulation: Formulation, plan: Window) -> bool:
    """Whether the system reaches the states of a plan, up to `_CONVERGED`."""
    scales = formulation.scales.states
    defect = np.max(np.abs(reference_defects(formulation.plant.system, plan)) / scales)
    return bool(defect <= _CONVERGED * max(1.0, float(np.max(np.abs(plan.states) / scales))))
