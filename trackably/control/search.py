"""Plan one step of a nonlinear system: by linearisations near the guess, and by a search if they do not converge."""

from dataclasses import replace
from typing import Any

import numpy as np
import scipy

from trackably.arrays import Array
from trackably.control.bounds import pull_inside
from trackably.control.problem import Formulation, StepProblem
from trackably.control.stepping import Infeasible, Plan, Status
from trackably.systems.constrained import System
from trackably.systems.reference import Window

_scipy: Any = scipy  # its type annotations lack arguments that are used here


def starts(problem: StepProblem, initial_guess: Array | None) -> list[Window]:
    """Return trajectories from the measured state to the end of the reference, the most promising first.

    They are: the simulation with the inputs `initial_guess` (N, m); the reference; the simulation with the reference's
    inputs; a straight line with these inputs; and the simulation with the middle of the input set.
    """
    plant, state, window = problem.formulation.plant, problem.state, problem.window
    system, N = plant.system, problem.formulation.horizon
    middle = np.tile(plant.input_set.centre, (N, 1))
    line = np.linspace(state, window.states[-1], N + 1)
    guessed = [] if initial_guess is None else [apply_inputs(system, state, initial_guess)]
    found = window, apply_inputs(system, state, window.inputs), Window(line, window.inputs)
    return [between(problem, trajectory) for trajectory in (*guessed, *found, apply_inputs(system, state, middle))]


def between(problem: StepProblem, trajectory: Window) -> Window:
    """Return a trajectory with its first state replaced by the measured one, and its last by that of the reference.

    Inputs and inner states are pulled into their sets. Inner states that are not finite become those of the reference.
    """
    plant, of_reference = problem.formulation.plant, problem.window.states
    defined = np.all(np.isfinite(trajectory.states), axis=1)[:, None]
    inside = np.where(defined, trajectory.states, of_reference)[1:-1]
    inner = [pull_inside(plant.state_set, x) for x in inside]
    inputs = [pull_inside(plant.input_set, u) for u in trajectory.inputs]
    return Window(np.vstack([problem.state, *inner, of_reference[-1]]), np.array(inputs))


def apply_inputs(system: System, state: Array, inputs: Array) -> Window:
    """Simulate the system from `state` (n,) under `inputs` (N, m)."""
    states = [state]
    for u in inputs:
        states.append(system.successor(states[-1], u))
    return Window(np.array(states), inputs)


FOLLOWED = 1e-9
"""The system follows a trajectory if the sum of its scaled defects is at most this."""

_ACCURACY = 1e-12  # tolerance of SciPy's search, for the scaled cost and constraints
_UNDEFINED = 1e3
"""A step for which f is undefined counts as a defect of this size, in scales."""


def missed_by(formulation: Formulation, at: Window) -> float:
    """Return by how much the trajectory `at` violates the dynamics: Σ_i ‖f(x_i, u_i) − x_(i+1)‖₁.

    States are divided by their scales. The result is infinite if f is undefined at a step.
    """
    missed = float(np.sum(np.abs(formulation.defects(at))))
    return missed if np.isfinite(missed) else np.inf


def minimise(problem: StepProblem, start: Window, weight: float = 1.0) -> Window:
    """Return the trajectory at which a search for the least `weight` · V ends, which begins at the trajectory `start`.

    V is the cost of a plan; with `weight` 0, any plan will do. The states between the first and the last one are
    variables, as are the inputs. So the search may begin with a trajectory that the system does not follow, and an
    unstable system amplifies errors for one step only. The search is SciPy's sequential quadratic programming (Kraft
    1988: A software package for sequential quadratic programming). If `missed_by` of the result exceeds `FOLLOWED`, the
    system does not follow it, and no plan was found.
    """
    formulation, window = problem.formulation, problem.window
    weights, bounds, first = weight * formulation.weights, formulation.bounds, formulation.errors(start, window)
    (steps, n), moves = window.states.shape, np.full(len(first), True)
    moves[:n] = moves[(steps - 1) * n : steps * n] = False
    limits = problem.slack - bounds @ np.where(moves, 0.0, first)
    bounded = bounds[:, moves].any(axis=1)
    inner = bounds[bounded][:, moves]

    def whole(z: Array) -> Array:
        found = first.copy()
        found[moves] = z
        return found

    def trajectory(z: Array) -> Window:
        return Window(*map(np.add, window, formulation.split(whole(z))))

    def defects(z: Array) -> Array:
        found = formulation.defects(trajectory(z))
        return np.where(np.isfinite(found), found, _UNDEFINED).ravel()

    def slopes(z: Array) -> Array:
        return np.nan_to_num(formulation.programs(trajectory(z)).dynamics[:, moves])

    followed = {"type": "eq", "fun": defects, "jac": slopes}
    kept = {"type": "ineq", "fun": lambda z: limits[bounded] - inner @ z, "jac": lambda z: -inner}
    found = _scipy.optimize.minimize(
        lambda z: float(whole(z) @ weights @ whole(z)),
        first[moves],
        jac=lambda z: 2 * (weights @ whole(z))[moves],
        method="SLSQP",
        constraints=[followed, kept],
        tol=_ACCURACY,
    )
    return trajectory(found.x)


MAX_LINEARISATIONS = 12
"""Largest number of full steps, each of which linearises along the last plan and plans again. Near a solution, they
converge quadratically."""

_CONVERGED = 1e-12
"""The full steps have converged when no defect of a plan exceeds this, in scales and relative to the size of the plan.
As convergence is quadratic, the last two plans then differ by about 1e-6."""

_AS_CHEAP = 1e-12
"""Costs that differ by less than this part of the scale of the cost count as equal."""


def solve_by_linearisation(reference: StepProblem, initial_guess: Array | None) -> Plan | Infeasible:
    """Solve a step by sequential linearisation, from the inputs `initial_guess` (N, m) or from the reference.

    `reference` is the problem of the step, linearised along the reference.

    Full steps come first: each problem is linearised along the plan of the one before. If they lead to no plan, or to
    one that costs more than an admissible guess, searches from several `starts` follow (`minimise`). The result is
    local: a minimum among nearby plans, or the reason why none was found. If the guess is admissible and no cheaper
    plan is found, the guess is returned. With the shifted last plan as the guess, feasibility is thus never lost and
    the cost never rises, whatever the search does. Raises ArithmeticError if no plan is found and the last
    linearisation does not explain why, or if the system is undefined along the reference.
    """
    _ = reference.defects  # computed here, to raise ArithmeticError at once
    problem, kept = (reference, None) if initial_guess is None else _problem_at_guess(reference, initial_guess)
    near, tie = _by_full_steps(problem), _AS_CHEAP * reference.formulation.scales.cost
    if isinstance(near, Plan) and (kept is None or near.cost <= kept.cost + tie):
        return near if kept is None or near.cost <= kept.cost else kept
    if kept is None:
        return _search(problem, initial_guess, near)
    plan = _converge_from(problem, minimise(problem, between(problem, kept.trajectory)))
    return plan if plan is not None and plan.cost < kept.cost else kept


def _problem_at_guess(reference: StepProblem, guess: Array) -> tuple[StepProblem, Plan | None]:
    """Return the problem along the trajectory of a guess, and the plan with the guessed inputs if it is admissible.

    If the system is undefined along the guess, return the problem along the reference.
    """
    try:
        along_guess = apply_inputs(reference.formulation.plant.system, reference.state, guess)
        problem = replace(reference, nominal=along_guess)
        plan = problem.plan_with(guess, Status.KEPT)
    except ArithmeticError:
        return reference, None
    return problem, plan if problem.is_feasible(plan) else None


def _by_full_steps(problem: StepProblem) -> Plan | Infeasible | None:
    """Linearise along the last plan and plan again, until the system follows the plan.

    Return this plan, or the reason why there is none; None if this does not converge.
    """
    try:
        for _ in range(MAX_LINEARISATIONS):
            plan = problem.optimum or problem.widest
            if _is_reached(problem.formulation, plan.trajectory):
                return problem.answer
            problem = replace(problem, nominal=plan.trajectory)
    except (ArithmeticError, np.linalg.LinAlgError):
        return None
    return None


def _search(problem: StepProblem, initial_guess: Array | None, near: Infeasible | Plan | None) -> Plan | Infeasible:
    """Return a plan found from one of the `starts`, or the reason why there is none nearby.

    `near` is the answer of full steps (repeated linearisations), None if they did not converge.
    """
    tried: list[Window] = []
    for start in starts(problem, initial_guess):
        tried.append(found := minimise(problem, start, 0.0))
        if missed_by(problem.formulation, found) <= FOLLOWED:
            plan = _converge_from(problem, minimise(problem, found)) or _converge_from(problem, found)
            if plan is not None:
                return plan
    if isinstance(near, Infeasible):
        return near
    closest = replace(problem, nominal=min(tried, key=lambda at: missed_by(problem.formulation, at)))
    _ = closest.defects  # computed here, to raise ArithmeticError if the system is undefined along the trajectory
    return _explain(closest)


def _converge_from(problem: StepProblem, found: Window) -> Plan | None:
    """Return the plan to which full steps converge from the trajectory `found`.

    If they do not converge, return `found` itself as a plan; None if it is not admissible.
    """
    if missed_by(problem.formulation, found) > FOLLOWED:
        return None
    try:
        near = replace(problem, nominal=found)
        if isinstance(converged := _by_full_steps(near), Plan):
            return converged
        plan = near.plan_with(found.inputs, Status.ADMISSIBLE)
        return plan if near.is_feasible(plan) else None
    except (ArithmeticError, np.linalg.LinAlgError):
        return None


def _explain(closest: StepProblem) -> Infeasible:
    """Return why the problem along the trajectory with the smallest defects has no plan.

    Raises ArithmeticError if it has a plan although the search found none, or if the solver fails.
    """
    try:
        result = _by_full_steps(closest)
        if isinstance(result, Infeasible):
            return result
        if isinstance(answer := closest.answer, Infeasible):
            return answer
    except (ArithmeticError, np.linalg.LinAlgError):
        pass
    raise ArithmeticError(
        "no plan was found; the best trajectory of the search violates the system's equations by "
        f"{missed_by(closest.formulation, closest.nominal):.3g}, the sum over all steps and states of errors relative "
        "to the states' ranges"
    )


def _is_reached(formulation: Formulation, plan: Window) -> bool:
    """Whether the system reaches the states of a plan, up to `_CONVERGED`."""
    largest = float(np.max(np.abs(plan.states) / formulation.scales.states))
    return bool(np.max(np.abs(formulation.defects(plan))) <= _CONVERGED * max(1.0, largest))
