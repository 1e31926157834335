"""One step of a nonlinear system: linearisations that converge near by, and a search wherever they do not."""

import numpy as np

from trackably.arrays import Array
from trackably.control.step.error_model import reference_defects
from trackably.control.step.formulation import Formulation
from trackably.control.step.problem import StepProblem
from trackably.control.step.result import Infeasible, Plan, Status
from trackably.control.step.starts import apply_inputs, between, starts
from trackably.control.step.trajectories import Trajectories
from trackably.control.step.trust_region import Found, cheaper, followed, restored
from trackably.systems.reference import Window

MAX_LINEARISATIONS = 12
"""A sequence of full steps that has not converged by then is given up: near a solution it converges quadratically."""

_CONVERGED = 1e-12
"""The system follows a plan up to this part of its scales. Convergence is quadratic: plans then differ by about
1e-6."""

_AS_CHEAP = 1e-12
"""Costs that differ by less than this part of their scale count as equal."""


def solve_by_linearisation(
    formulation: Formulation, k: int, state: Array, window: Window, initial_guess: Array | None
) -> Plan | Infeasible:
    """Solve step `k` by sequential linearisation, from the inputs `initial_guess` (N, m) or from the reference.

    Full steps come first: each problem is linearised along the plan of the one before. Where they lead to no plan, or
    to one that costs more than an admissible guess, trust regions search for one from several `starts`. The result is
    local: a minimum, or the reason why none was found, among the plans near by. If the guess is admissible and nothing
    found costs less, it is returned instead. With the shifted last plan as the guess, feasibility is thus never lost
    and the cost never rises, whatever the search does. Raises ArithmeticError where no plan is found and the
    linearisation at the end of the search does not tell why, and where the system is not defined along the reference.
    """
    reference = _linearised(formulation, k, state, window, window)
    problem, kept = (reference, None) if initial_guess is None else _guessed(reference, initial_guess)
    near = _by_full_steps(problem)
    if isinstance(near, Plan) and (kept is None or near.cost <= kept.cost + _AS_CHEAP * formulation.scales.cost):
        return near if kept is None or near.cost <= kept.cost else kept
    if kept is not None:
        return _improved(problem, kept)
    return _searched(problem, initial_guess, near)


def _guessed(reference: StepProblem, guess: Array) -> tuple[StepProblem, Plan | None]:
    """Return the problem along the trajectory of a guess, and its plan where that is admissible; the problem along the
    reference where the system is not defined along the guess."""
    try:
        problem = _along(reference, apply_inputs(reference.formulation.plant.system, reference.state, guess))
        plan = problem.plan(guess - reference.window.inputs, Status.KEPT)
    except ArithmeticError:
        return reference, None
    return problem, plan if problem.is_feasible(plan) else None


def _by_full_steps(problem: StepProblem) -> Plan | Infeasible | None:
    """Return the result of the last of a sequence of problems, each linearised along the plan of the one before; None
    where they do not converge."""
    try:
        for _ in range(MAX_LINEARISATIONS):
            plan = problem.optimum or problem.widest
            nominal = Window(plan.states, plan.inputs)
            if _is_followed(problem.formulation, nominal):
                return problem.optimum or problem.infeasible
            problem = _along(problem, nominal)
    except (ArithmeticError, np.linalg.LinAlgError):
        return None
    return None


def _improved(problem: StepProblem, kept: Plan) -> Plan:
    """Return the cheapest plan that is found from an admissible one."""
    trajectories = Trajectories(problem.formulation, problem.window)
    guess = between(problem.formulation, Window(kept.states, kept.inputs), problem.state, problem.window)
    plan = _cheaper(problem, trajectories, guess)
    return plan if plan is not None and plan.cost < kept.cost else kept


def _searched(problem: StepProblem, initial_guess: Array | None, near: Infeasible | Plan | None) -> Plan | Infeasible:
    """Return a plan that is found from one of the starts, or why there is none near by."""
    trajectories = Trajectories(problem.formulation, problem.window)
    closest: Found | None = None
    for start in starts(problem.formulation, problem.state, problem.window, initial_guess):
        found = restored(trajectories, start)
        if found.is_followed:
            plan = _cheaper(problem, trajectories, found.trajectory) or _finished(problem, trajectories, found)
            if plan is not None:
                return plan
        if closest is None or found.missed < closest.missed:
            closest = found
    if isinstance(near, Infeasible):
        return near
    if closest is None or not np.isfinite(closest.missed):
        raise ArithmeticError("a plan leads where the system is not defined")
    return _explained(problem, closest)


def _cheaper(problem: StepProblem, trajectories: Trajectories, start: Window) -> Plan | None:
    """Return the plan at which a search for lower costs ends; None where that is none."""
    found = cheaper(trajectories, start)
    return _finished(problem, trajectories, found if found.is_followed else restored(trajectories, found.trajectory))


def _finished(problem: StepProblem, trajectories: Trajectories, found: Found) -> Plan | None:
    """Return the plan to which full steps converge from what was found, or else what was found itself; None where that
    is no plan."""
    if not found.is_followed:
        return None
    try:
        converged = _by_full_steps(_along(problem, found.trajectory))
        return converged if isinstance(converged, Plan) else _as_found(problem, followed(trajectories, found))
    except (ArithmeticError, np.linalg.LinAlgError):
        return None


def _as_found(problem: StepProblem, nominal: Window) -> Plan | None:
    """Return a trajectory that the system follows as a plan; None where it keeps the sets not even up to tolerances."""
    near = _along(problem, nominal)
    plan = near.plan(nominal.inputs - problem.window.inputs, Status.ADMISSIBLE)
    return plan if near.is_feasible(plan) else None


def _explained(problem: StepProblem, closest: Found) -> Infeasible:
    """Return why the linearisation along the trajectory that is followed best has no plan.

    Raises ArithmeticError where it has one, though the search did not find it, and where the solver does not tell.
    """
    try:
        near = _along(problem, closest.trajectory)
        result = _by_full_steps(near)
        if isinstance(result, Infeasible):
            return result
        if near.optimum is None:
            return near.infeasible
    except (ArithmeticError, np.linalg.LinAlgError):
        pass
    missed = f"{closest.missed:.3g} of the scales of the states"
    raise ArithmeticError(f"no plan was found; the system misses the best trajectory of the search by {missed}")


def _along(problem: StepProblem, nominal: Window) -> StepProblem:
    """Return the same problem, linearised along another trajectory."""
    return _linearised(problem.formulation, problem.k, problem.state, problem.window, nominal)


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
