"""From where a controller can start: the states that N admissible steps lead onto the reference."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog

from trackable.arrays import Array
from trackable.control.controller import Controller
from trackable.control.followed import Followed
from trackable.control.step.prediction import Prediction, gaps
from trackable.control.step.room import Room, Sets
from trackable.systems.linear import LinearSystem

_CORNER = 1e-7
"""A support point this far (a part of the set's size) beyond an edge counts as on it."""


def feasible_states(controller: Controller, reference: Followed, k: int) -> Array:
    """Corners of the set of states x(k) ∈ X from which the controller has a plan at step `k`: shape (corners, n).

    For one state its two ends, for two a polygon, counterclockwise; no corner at all where the set is empty. Exact up
    to the accuracy of linear programs, since each edge is asked whether the set goes on beyond it. ValueError for more
    states, for a nonlinear system, and where X leaves the set unbounded.
    """
    n = len(controller.plant.system.states)
    if not isinstance(controller.plant.system, LinearSystem):
        raise ValueError("feasible set: it is drawn for linear systems only, whose sets are convex")
    if n > 2:
        raise ValueError(f"feasible set: it is drawn for one or two states, got {n}")
    projection = _Projection.at(controller, reference, k)
    if projection.support(np.eye(n)[0]) is None:
        return np.empty((0, n))
    if n == 1:
        return np.array([projection.farthest(np.array([-1.0])), projection.farthest(np.array([1.0]))])
    turns = [np.array(d) for d in ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))]
    first = [projection.farthest(d) for d in turns]
    size = np.ptp(first, axis=0)
    if not np.all(size > 0):
        return _distinct(first, size)
    corners: list[Array] = []
    for p, q in zip(first, [*first[1:], first[0]], strict=True):
        corners += [p, *_between(projection, p, q, size)]
    return _distinct(corners, size)


@dataclass(frozen=True, eq=False)
class _Projection:
    """{x : some V has M (x, V) ≤ b and E (x, V) = f}: a polyhedron, seen through its first n coordinates."""

    M: Array
    b: Array
    E: Array
    f: Array
    n: int

    @classmethod
    def at(cls, controller: Controller, reference: Followed, k: int) -> "_Projection":
        plant, window = controller.plant, reference.window(k, controller.horizon)
        prediction = Prediction.along(plant.system, window)
        sets, drift = Sets.of(plant), (prediction.drift @ gaps(plant.system, window).ravel())
        room, H, h, G = Room.around(sets, window), sets.states.rows, sets.states.ends, sets.inputs.rows
        (N, n, m), x = prediction.B.shape, window.states[0]
        over_all = np.kron(np.eye(N), H)
        E = np.hstack([prediction.free, prediction.forced])
        shift = drift - prediction.free @ x  # errors are M (x(k), V) + shift
        M = np.vstack([
            over_all @ E,
            np.hstack([np.zeros((N * len(G), n)), np.kron(np.eye(N), G)]),
            np.hstack([H, np.zeros((len(H), N * m))]),
        ])  # fmt: skip
        b = np.concatenate([room.states.ravel() - over_all @ shift, room.inputs.ravel(), h])
        return cls(M, b, E[-n:], -shift[-n:], n)

    def support(self, direction: Array) -> Array | None:
        """A state farthest in a direction; None where there is no state at all."""
        program = linprog(
            np.concatenate([-direction, np.zeros(self.M.shape[1] - self.n)]),
            A_ub=self.M if len(self.M) else None,
            b_ub=self.b if len(self.M) else None,
            A_eq=self.E,
            b_eq=self.f,
            bounds=(None, None),
            method="highs-ds",
        )
        if program.status == 3:
            raise ValueError("feasible set: it is unbounded, and has no corners; bound the state set")
        return None if program.x is None else np.asarray(program.x[: self.n])

    def farthest(self, direction: Array) -> Array:
        """As `support`, of a set that is not empty."""
        found = self.support(direction)
        if found is None:
            raise ArithmeticError("feasible set: the numbers are beyond the solver")
        return found


def _between(projection: _Projection, p: Array, q: Array, size: Array) -> list[Array]:
    """The corners from p to q, counterclockwise, both left out."""
    edge = (q - p) / size
    if np.max(np.abs(edge)) <= _CORNER:
        return []
    normal = np.array([edge[1], -edge[0]]) / np.hypot(*edge)
    r = projection.farthest(normal / size)
    if normal @ ((r - p) / size) <= _CORNER:
        return []
    return [*_between(projection, p, r, size), r, *_between(projection, r, q, size)]


def _distinct(corners: list[Array], size: Array) -> Array:
    """Without repetitions, around the polygon."""
    scale = np.where(size > 0, size, 1.0)
    kept = [p for p, q in zip(corners, [*corners[1:], corners[0]], strict=True)
            if np.max(np.abs(p - q) / scale) > _CORNER]  # fmt: skip
    return np.array(kept or corners[:1])
