"""The feasible set of a controller: the states from which N admissible steps lead onto the reference."""

from collections.abc import Callable

import numpy as np
import scipy

from pipeline.loops.trajectory import Course
from trackably.arrays import Array
from trackably.control.controller import Controller, shortest_horizon
from trackably.control.problem import StepProblem
from trackably.control.references import TrackedReference
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import rows_in_widths, slacks

_CORNER = 1e-7
"""A support point that lies beyond an edge by at most this part of the set's size counts as on the edge."""


class _NoStateError(ArithmeticError):
    """The set is empty, or the solver fails."""


def feasible_set(controller: Controller, reference: TrackedReference, k: int) -> Array:
    """Return the corners of the set of states x(k) ∈ X from which the controller has a plan at step `k`.

    The system is linear and has one or two states. The shape is (corners, n): both ends of an interval for one state,
    the corners of a polygon in counterclockwise order for two, and no corner if the set is empty. The corners are exact
    up to the accuracy of linear programs, because a linear program decides for each edge whether the set extends beyond
    it. Raises ValueError if the set is unbounded.
    """
    n = len(controller.plant.system.states)
    farthest = _farthest(controller, reference, k)
    try:
        first = [farthest(direction) for direction in (*np.eye(n), *-np.eye(n))]
    except _NoStateError:
        return np.empty((0, n))
    if n == 1:
        return np.array(first[::-1])
    size = np.ptp(first, axis=0)
    corners = first
    if np.all(size > 0):
        sides = zip(first, [*first[1:], first[0]], strict=True)
        corners = [corner for p, q in sides for corner in (p, *_between(farthest, p, q, size))]
    scale = np.where(size > 0, size, 1.0)
    different = [np.max(np.abs(p - q) / scale) > _CORNER for p, q in zip(corners, np.roll(corners, -1, 0), strict=True)]
    return np.array(corners)[different] if any(different) else np.array(corners[:1])


def _farthest(controller: Controller, reference: TrackedReference, k: int) -> Callable[[Array], Array]:
    """Return a function that gives a state, of the feasible ones at step `k`, that is farthest in a direction (n,).

    These states are {x : M z ≤ b and E z = f for some z}, with z = (e(0), …, e(N), v(0), …). Errors e = x − x_r of
    states and v of inputs are divided by their scales, because the solver's tolerances are absolute.
    """
    plant, window, scales = controller.plant, reference.window(k, controller.horizon), controller.formulation.scales
    problem = StepProblem(controller.formulation, k, window.states[0], window, window)
    programs, x_r, of_states = problem.programs, window.states[0], rows_in_widths(plant.state_set, scales.states)
    tracking, (r, n) = programs.tracking, of_states.shape
    now = np.hstack([of_states, np.zeros((r, len(tracking.q) - n))])
    M, E = np.vstack([programs.bounds, now]), np.asarray(tracking.A)[n : tracking.equations]
    b, f = np.append(problem.slack, slacks(plant.state_set, x_r)), np.append(-problem.defects, np.zeros(n))

    def farthest(direction: Array) -> Array:
        along = direction * scales.states
        costs = np.concatenate([-along / np.max(np.abs(along)), np.zeros(M.shape[1] - n)])
        program = scipy.optimize.linprog(costs, M, b, E, f, bounds=(None, None), method="highs-ds")
        if program.status == 3:
            raise ValueError("feasible set: expected a bounded set, which has corners; bound all states")
        if program.x is None:
            raise _NoStateError("feasible set: the solver fails; choose other units if numbers are extreme")
        return np.asarray(x_r + scales.states * program.x[:n])

    return farthest


def _between(farthest: Callable[[Array], Array], p: Array, q: Array, size: Array) -> list[Array]:
    """Return the corners between p and q, counterclockwise, without p and q."""
    edge = (q - p) / size
    if np.max(np.abs(edge)) <= _CORNER:
        return []
    normal = np.array([edge[1], -edge[0]]) / np.hypot(*edge)
    r = farthest(normal / size)
    if normal @ ((r - p) / size) <= _CORNER:
        return []
    return [*_between(farthest, p, r, size), r, *_between(farthest, r, q, size)]


_INSTANTS = 80


def feasible_over_time(
    controller: Controller, reference: TrackedReference, horizons: tuple[int, ...], steps: range
) -> dict[str, Course]:
    """Return the feasible set for each horizon, by topic; empty for nonlinear systems and three states or more.

    For one state, a course has the ends `lower` and `upper` of the set at up to 81 of the `steps`. For two states, it
    has the corners at the first step, under the names of the states. Horizons too short for the system are left out.
    """
    system, states = controller.plant.system, controller.plant.system.states
    if not isinstance(system, LinearSystem) or len(states) > 2:
        return {}
    instants = np.unique(np.linspace(steps.start, steps[-1], _INSTANTS + 1).round().astype(int)).tolist()
    found = {}
    for N in horizons:
        if shortest_horizon(controller.plant) <= N:
            at = Controller(controller.plant, N, controller.Q, controller.R)
            if len(states) == 2:
                corners = feasible_set(at, reference, steps.start)
                course = Course(np.full(len(corners), float(steps.start)), dict(zip(states, corners.T, strict=True)))
            else:
                sets = [feasible_set(at, reference, k) for k in instants]
                ends = np.array([of[[0, -1], 0] if len(of) else (np.nan, np.nan) for of in sets])
                course = Course(np.array(instants, dtype=float), {"lower": ends[:, 0], "upper": ends[:, 1]})
            if len(course.steps):
                found[f"/feasible/horizon_{N}"] = course
    return found
