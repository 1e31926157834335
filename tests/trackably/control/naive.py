"""Naive second implementations of a controller's step: built anew at each step, in states and inputs, not errors."""

import cvxpy as cp
import numpy as np
from scipy.optimize import minimize

from trackably.control.controller import Controller


def _program(controller: Controller, k: int, state, reference, wider: float = 0.0):
    """Return the cost V, the miss x(k+N) − x_r(k+N) in widths of the state set, u, and the constraints but the end."""
    plant, N = controller.plant, controller.horizon
    system, X, U = plant.system, plant.state_set, plant.input_set
    n, m = system.B.shape
    x, u = cp.Variable((N + 1, n)), cp.Variable((N, m))
    e = x - np.array([reference.state(k + i) for i in range(N + 1)])
    v = u - np.array([reference.input(k + i) for i in range(N)])
    kept = [x[0] == state]
    for i in range(N):
        kept.append(x[i + 1] == system.A @ x[i] + system.B @ u[i] + system.c)
        for at, bounded in ((x[i + 1], X), (u[i], U)):
            more = wider * (bounded.upper - bounded.lower)
            kept += [bounded.rows @ at <= bounded.upper + more, bounded.rows @ at >= bounded.lower - more]
    cost = sum(cp.quad_form(e[i], controller.Q) + cp.quad_form(v[i], controller.R) for i in range(N))
    return cost, e[N] / (X.upper - X.lower), u, kept


def _solved(aim, kept) -> float:
    problem = cp.Problem(cp.Minimize(aim), kept)
    problem.solve(solver=cp.CLARABEL)
    return problem.value


def optimum(controller: Controller, k: int, state, reference, wider: float = 0.0):
    """Return (V, u(k)) with all sets widened by a part `wider` of their widths; (inf, None) where there is no plan."""
    cost, missed, u, kept = _program(controller, k, state, reference, wider)
    return _solved(cost, [*kept, missed == 0]), None if u.value is None else u.value[0]


def smallest_miss(controller: Controller, k: int, state, reference) -> float:
    """Return min ‖x(k+N) − x_r(k+N)‖ in widths of the state set, a box; inf where no plan keeps the sets."""
    _, missed, _, kept = _program(controller, k, state, reference)
    return _solved(cp.norm(missed), kept)


def closest_plan_cost(controller: Controller, k: int, state, reference, miss: float) -> float:
    """Return the least cost of a plan that ends within `miss` widths of the reference."""
    cost, missed, _, kept = _program(controller, k, state, reference)
    return _solved(cost, [*kept, cp.norm(missed) <= miss])


def cost_of_a_minimum(controller: Controller, state, window, start=None) -> float:
    """Return the cost of the minimum that SLSQP finds from a window, in states and inputs of boxes."""
    system, X, U, N = (
        controller.plant.system,
        controller.plant.state_set,
        controller.plant.input_set,
        len(window.inputs),
    )
    start = window if start is None else start

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
