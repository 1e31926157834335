"""Naive second implementations of a controller's step: built anew at each step, in states and inputs, not errors."""

import cvxpy as cp
import numpy as np
from scipy.optimize import minimize

from tests.trackably.systems.disturbance.naive import extremes
from trackably.control.controller import Controller
from trackably.control.tube import TubeController
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.polytopes import Polytope


def _program(controller: Controller, plant: ConstrainedSystem, k: int, reference, wider: float = 0.0):
    """Return the cost V, x and u with what they keep but for start and end, and the end's miss x(k+N) − x_r(k+N)."""
    system, N = plant.system, controller.horizon
    n, m = system.B.shape
    x, u = cp.Variable((N + 1, n)), cp.Variable((N, m))
    e = x - np.array([reference.state(k + i) for i in range(N + 1)])
    v = u - np.array([reference.input(k + i) for i in range(N)])
    kept = [x[1:] == x[:-1] @ system.A.T + u @ system.B.T + np.tile(system.c, (N, 1))]
    kept += _inside(plant.state_set, x[1:], wider) + _inside(plant.input_set, u, wider)
    parts = (e[:-1], controller.Q), (v, controller.R)
    cost = sum(cp.sum_squares(part @ np.linalg.cholesky(weight)) for part, weight in parts)
    return cost, x, u, kept, e[N]


def _inside(bounded: Polytope, points: cp.Expression, wider: float = 0.0) -> list[cp.Constraint]:
    more, seen = wider * (bounded.upper - bounded.lower), points @ bounded.rows.T
    lower, upper = (np.broadcast_to(end, seen.shape) for end in (bounded.lower - more, bounded.upper + more))
    return [seen <= upper, seen >= lower]


def _solved(aim, kept) -> float:
    """Return the optimal value; inf where there is none."""
    problem = cp.Problem(cp.Minimize(aim), kept)
    problem.solve(solver=cp.CLARABEL)
    return np.inf if problem.value is None else float(problem.value)


def optimum(controller: Controller, k: int, state, reference, wider: float = 0.0):
    """Return (V, u(k)) with all sets widened by a part `wider` of their widths; (inf, None) where there is no plan."""
    cost, x, u, kept, missed = _program(controller, controller.plant, k, reference, wider)
    return _solved(cost, [*kept, x[0] == state, missed == 0]), None if u.value is None else u.value[0]


def closest_end(controller: Controller, k: int, state, reference):
    """Return min ‖x(k+N) − x_r(k+N)‖ in widths of the state set, a box, and u(k) of the cheapest plan with this end.

    The distance is inf where no plan keeps the sets.
    """
    X = controller.plant.state_set
    cost, x, u, kept, missed = _program(controller, controller.plant, k, reference)
    kept, miss = [*kept, x[0] == state], cp.norm(missed / (X.upper - X.lower))
    if (least := _solved(miss, kept)) < np.inf:
        _solved(cost, [*kept, miss <= least * (1 + 1e-6)])
    return least, u.value[0] if least < np.inf else None


def tube_optimum(controller: TubeController, k: int, state: np.ndarray, reference) -> float:
    """Return the optimal cost of a nominal plan from a start z(k) in x(k) ⊖ Z; inf where there is none."""
    plant = controller.tightening.plant
    cost, z, _, kept, missed = _program(controller, plant, k, reference)
    start = [*in_error_set(controller.invariant, state - z[0]), *_inside(plant.state_set, z[0])]
    return _solved(cost, [*kept, *start, missed == 0])


def in_error_set(Z, e: cp.Expression) -> list[cp.Constraint]:
    """e = Σ_{i<N} A_Kⁱ w_i + A_Kᴺ (1 − α)⁻¹ Σ_{i<s} A_Kⁱ p_i with w_i in W and p_i in P."""
    total, constraints, power, n = 0, [], np.eye(len(Z.box)), len(Z.box)
    for i in range(Z.head + Z.terms):
        if i >= Z.head:
            p = cp.Variable(n)
            constraints.append(cp.abs(p) <= np.array(Z.box) / (1 - Z.contraction))
            total = total + power @ p
        else:
            corners = extremes(Z.disturbance)
            parts = cp.Variable(len(corners), nonneg=True)
            constraints.append(cp.sum(parts) == 1)
            total = total + power @ (parts @ corners)
        power = power @ Z.closed_loop
    return [*constraints, e == total]


def cost_of_a_minimum(controller: Controller, state, window, start=None) -> float:
    """Return the cost of the minimum that SLSQP finds from a window, in states and inputs of boxes."""
    plant, N = controller.plant, len(window.inputs)
    system, X, U = plant.system, plant.state_set, plant.input_set
    start = start or window

    def split(z):
        inner, inputs = np.split(z, [(N - 1) * len(state)])
        return np.vstack([state, inner.reshape(N - 1, -1), window.states[-1]]), inputs.reshape(N, -1)

    def cost(z):
        x, u = split(z)
        e, d = x[:-1] - window.states[:-1], u - window.inputs
        return np.einsum("ia,ab,ib->", e, controller.Q, e) + np.einsum("ia,ab,ib->", d, controller.R, d)

    def missed(z):
        x, u = split(z)
        return (system.successor(x[:-1], u) - x[1:]).ravel()

    lower, upper = (
        np.concatenate([np.tile(x, N - 1), np.tile(u, N)]) for x, u in ((X.lower, U.lower), (X.upper, U.upper))
    )
    found = minimize(
        cost,
        np.concatenate([start.states[1:-1].ravel(), start.inputs.ravel()]),
        method="SLSQP",
        bounds=list(zip(lower, upper, strict=True)),
        constraints=[{"type": "eq", "fun": missed}],
        options={"ftol": 1e-14, "maxiter": 500},
    )
    assert np.max(np.abs(missed(found.x))) < 1e-9
    return float(found.fun)
