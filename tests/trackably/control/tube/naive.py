"""The step of the tube controller as it is written, built afresh, with Z as the sum of its parts."""

import cvxpy as cp
import numpy as np

from trackably.control.tube import TubeController
from trackably.systems.disturbances import Zonotope


def in_error_set(Z, e: cp.Expression) -> list[cp.Constraint]:
    """e = Σ_{i<N} A_Kⁱ w_i + A_Kᴺ (1 − α)⁻¹ Σ_{i<s} A_Kⁱ p_i with w_i in W and p_i in P."""
    total, constraints, power, n = 0, [], np.eye(len(Z.box)), len(Z.box)
    for i in range(Z.head + Z.terms):
        if i >= Z.head:
            p = cp.Variable(n)
            constraints.append(cp.abs(p) <= Z.box / (1 - Z.contraction))
            total = total + power @ p
        elif isinstance(Z.disturbance, Zonotope):
            parts = cp.Variable(len(Z.disturbance.generators))
            constraints.append(cp.abs(parts) <= 1)
            w = np.array(Z.disturbance.centre, dtype=float) + parts @ np.array(Z.disturbance.generators, dtype=float)
            total = total + power @ w
        else:
            parts = cp.Variable(len(Z.disturbance.vertices), nonneg=True)
            constraints.append(cp.sum(parts) == 1)
            total = total + power @ (parts @ np.array(Z.disturbance.vertices, dtype=float))
        power = power @ Z.closed_loop
    return [*constraints, e == total]


def optimum(controller: TubeController, k: int, state: np.ndarray, reference) -> float:
    """The optimal cost, infinite where there is no plan."""
    system, plant, N = controller.plant.system, controller.tightening.plant, controller.horizon
    window = reference.window(k, N)
    z, v = cp.Variable((N + 1, len(controller.Q))), cp.Variable((N, len(controller.R)))
    constraints = [*in_error_set(controller.invariant, state - z[0]), z[N] == window.states[N]]
    for i in range(N):
        constraints += [z[i + 1] == system.A @ z[i] + system.B @ v[i] + system.c]
        for of, bounded in ((z[i], plant.state_set), (v[i], plant.input_set)):
            constraints += [bounded.rows @ of <= bounded.upper, bounded.rows @ of >= bounded.lower]
    cost = sum(
        cp.quad_form(z[i] - window.states[i], controller.Q) + cp.quad_form(v[i] - window.inputs[i], controller.R)
        for i in range(N)
    )
    program = cp.Problem(cp.Minimize(cost), constraints)
    program.solve(solver=cp.CLARABEL)
    return float(program.value) if program.status == cp.OPTIMAL else np.inf
