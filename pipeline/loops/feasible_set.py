"""The feasible set of a controller: the states from which N admissible steps lead onto the reference."""

from dataclasses import dataclass

import numpy as np
import scipy

from pipeline.loops.trajectory import Course
from trackably.arrays import Array
from trackably.control.bounds import Inequalities
from trackably.control.controller import Controller, shortest_horizon
from trackably.control.problem import StepProblem
from trackably.control.references import TrackedReference
from trackably.systems.linear import LinearSystem

_CORNER = 1e-7
"""A support point that lies beyond an edge by at most this part of the set's size counts as on the edge."""


def feasible_set(controller: Controller, reference: TrackedReference, k: int) -> Array:
    """Return the corners of the set of states x(k) ∈ X from which the controller has a plan at step `k`.

    The shape is (corners, n): both ends of an interval for one state, the corners of a polygon in counterclockwise
    order for two, and no corner if the set is empty. The corners are exact up to the accuracy of linear programs,
    because a linear program decides for each edge whether the set extends beyond it. Raises ValueError for more than
    two states, for a nonlinear system, and if the set is unbounded.
    """
    n = len(controller.plant.system.states)
    if not isinstance(controller.plant.system, LinearSystem):
        raise ValueError("feasible set: expected a linear system, whose feasible sets are convex, got a nonlinear one")
    if n > 2:
        raise ValueError(f"feasible set: expected a system of one or two states, got {n}")
    projection = _Projection.at(controller, reference, k)
    if projection.support(np.eye(n)[0]) is None:
        return np.empty((0, n))
    if n == 1:
        return np.array([projection.farthest(np.array([-1.0])), projection.farthest(np.array([1.0]))])
    directions = [np.array(d) for d in ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))]
    first = [projection.farthest(d) for d in directions]
    size = np.ptp(first, axis=0)
    if not np.all(size > 0):
        return _distinct(first, size)
    corners: list[Array] = []
    for p, q in zip(first, [*first[1:], first[0]], strict=True):
        corners += [p, *_between(projection, p, q, size)]
    return _distinct(corners, size)


@dataclass(frozen=True, eq=False)
class _Projection:
    """{x : M z ≤ b and E z = f for some z}, with x = `origin` + `scales` e(0) and z = (e(0), …, e(N), v(0), …).

    Errors e of states and v of inputs are divided by their scales, because the solver's tolerances are absolute.
    """

    M: Array
    b: Array
    E: Array
    f: Array
    origin: Array
    scales: Array

    @classmethod
    def at(cls, controller: Controller, reference: TrackedReference, k: int) -> "_Projection":
        """Return the states at step `k` from which input errors v lead onto the reference."""
        plant, window, scales = controller.plant, reference.window(k, controller.horizon), controller.formulation.scales
        problem = StepProblem.of(controller.formulation, k, window.states[0], window)
        programs, X, x_r = problem.programs, Inequalities.of(plant.state_set), window.states[0]
        tracking, (r, n) = programs.tracking, X.rows.shape
        now = np.hstack([X.in_widths(scales.states), np.zeros((r, len(tracking.q) - n))])
        M, E = np.vstack([programs.bounds, now]), np.asarray(tracking.A)[n : tracking.equations]
        b, f = np.append(problem.slack, X.slack(x_r)), np.append(-problem.defects, np.zeros(n))
        return cls(M, b, E, f, x_r, scales.states)

    def support(self, direction: Array) -> Array | None:
        """Return a state of the set that is farthest in a direction; None if the set is empty."""
        n, along = len(self.scales), direction * self.scales
        program = scipy.optimize.linprog(
            np.concatenate([-along / np.max(np.abs(along)), np.zeros(self.M.shape[1] - n)]),
            A_ub=self.M if len(self.M) else None,
            b_ub=self.b if len(self.M) else None,
            A_eq=self.E,
            b_eq=self.f,
            bounds=(None, None),
            method="highs-ds",
        )
        if program.status == 3:
            raise ValueError("feasible set: expected a bounded set, which has corners; bound all states")
        return None if program.x is None else np.asarray(self.origin + self.scales * program.x[:n])

    def farthest(self, direction: Array) -> Array:
        """Return a state that is farthest in a direction; the set is not empty. ArithmeticError: the solver fails."""
        found = self.support(direction)
        if found is None:
            raise ArithmeticError("feasible set: the solver fails; choose other units if numbers are extreme")
        return found


def _between(projection: _Projection, p: Array, q: Array, size: Array) -> list[Array]:
    """Return the corners between p and q, counterclockwise, without p and q."""
    edge = (q - p) / size
    if np.max(np.abs(edge)) <= _CORNER:
        return []
    normal = np.array([edge[1], -edge[0]]) / np.hypot(*edge)
    r = projection.farthest(normal / size)
    if normal @ ((r - p) / size) <= _CORNER:
        return []
    return [*_between(projection, p, r, size), r, *_between(projection, r, q, size)]


def _distinct(corners: list[Array], size: Array) -> Array:
    """Drop each corner that equals the next one."""
    scale = np.where(size > 0, size, 1.0)
    kept = [p for p, q in zip(corners, [*corners[1:], corners[0]], strict=True)
            if np.max(np.abs(p - q) / scale) > _CORNER]  # fmt: skip
    return np.array(kept or corners[:1])


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
