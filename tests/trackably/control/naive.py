"""Naive second implementations of a controller's step: built anew at each step, in states and inputs, not errors."""

import cvxpy as cp
import numpy as np
from scipy.optimize import minimize

from trackably.control.controller import Controller
from trackably.control.search import apply_inputs


def _variables(controller: Controller, k: int, state, reference, wider: float):
    plant, N = controller.plant, controller.horizon
    system, X, U = plant.system, plant.state_set, plant.input_set
    n, m = system.B.shape
    x, u = cp.Variable((n, N + 1)), cp.Variable((m, N))
    x_r = np.array([reference.state(k + i) for i in range(N + 1)])
    u_r = np.array([reference.input(k + i) for i in range(N)])
    kept = [x[:, 0] == state]
    more_x, more_u = wider * (X.upper - X.lower), wider * (U.upper - U.lower)
    for i in range(N):
        kept += [x[:, i + 1] == system.A @ x[:, i] + system.B @ u[:, i] + system.c]
        kept += [X.rows @ x[:, i + 1] <= X.upper + more_x, X.rows @ x[:, i + 1] >= X.lower - more_x]
        kept += [U.rows @ u[:, i] <= U.upper + more_u, U.rows @ u[:, i] >= U.lower - more_u]
    return x, u, x_r, u_r, kept


def optimum(controller: Controller, k: int, state, reference, wider: float = 0.0):
    """Return (V, u(k)) with all sets widened by a part `wider` of their widths; (inf, None) where there is no plan."""
    x, u, x_r, u_r, kept = _variables(controller, k, state, reference, wider)
    N = controller.horizon
    cost = sum(
        cp.quad_form(x[:, i] - x_r[i], controller.Q) + cp.quad_form(u[:, i] - u_r[i], controller.R) for i in range(N)
    )
    problem = cp.Problem(cp.Minimize(cost), [*kept, x[:, N] == x_r[N]])
    problem.solve(solver=cp.CLARABEL)
    return problem.value, None if u.value is None else u.value[:, 0]


def smallest_miss(controller: Controller, k: int, state, reference) -> float:
    """Return min ‖x(k+N) − x_r(k+N)‖ in widths of the state set, a box; inf where no plan keeps the sets."""
    x, _, x_r, _, kept = _variables(controller, k, state, reference, 0.0)
    problem = cp.Problem(cp.Minimize(cp.norm((x[:, -1] - x_r[-1]) / _widths(controller))), kept)
    problem.solve(solver=cp.CLARABEL)
    return problem.value


def closest_plan_cost(controller: Controller, k: int, state, reference, miss: float) -> float:
    """Return the least cost of a plan that ends within `miss` widths of the reference."""
    x, u, x_r, u_r, kept = _variables(controller, k, state, reference, 0.0)
    N, e, v = controller.horizon, x.T - x_r, u.T - u_r
    cost = sum(cp.quad_form(e[i], controller.Q) + cp.quad_form(v[i], controller.R) for i in range(N))
    near = cp.norm((x[:, -1] - x_r[-1]) / _widths(controller)) <= miss
    problem = cp.Problem(cp.Minimize(cost), [*kept, near])
    problem.solve(solver=cp.CLARABEL)
    return problem.value


def _widths(controller: Controller) -> np.ndarray:
    return controller.plant.state_set.upper - controller.plant.state_set.lower


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
