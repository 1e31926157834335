"""Naive second implementations of a controller's step: built anew at each step, in states and inputs, not errors."""

import cvxpy as cp
import numpy as np
from scipy.optimize import minimize

from trackably.control.controller import Controller
from trackably.control.search import apply_inputs


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


def cost_by_single_shooting(controller, state, window) -> float:
    """Return the optimal cost of a nonlinear system, found by single shooting with SLSQP."""
    system, plant, shape = controller.plant.system, controller.plant, window.inputs.shape

    def states(v):
        return apply_inputs(system, state, v.reshape(shape)).states

    def cost(v):
        e, d = states(v)[:-1] - window.states[:-1], v.reshape(shape) - window.inputs
        return np.einsum("ia,ab,ib->", e, controller.Q, e) + np.einsum("ia,ab,ib->", d, controller.R, d)

    X, lower, upper = plant.state_set, plant.input_set.lower, plant.input_set.upper
    found = minimize(
        cost,
        window.inputs.ravel(),
        method="SLSQP",
        bounds=list(zip(np.tile(lower, shape[0]), np.tile(upper, shape[0]), strict=True)),
        constraints=[
            {"type": "eq", "fun": lambda v: states(v)[-1] - window.states[-1]},
            {"type": "ineq", "fun": lambda v: (states(v)[1:] @ X.rows.T - X.lower).ravel()},
            {"type": "ineq", "fun": lambda v: (X.upper - states(v)[1:] @ X.rows.T).ravel()},
        ],
        options={"ftol": 1e-14, "maxiter": 500},
    )
    return float(found.fun)
