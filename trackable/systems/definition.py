"""Trackability taken at its word (Definition 1 of the paper): do admissible inputs exist?

A second opinion that never solves the dynamics for the input: a convex program looks for the inputs instead.
"""

import cvxpy as cp
import numpy as np

from trackable.systems.reference import Reference


def smallest_defect(reference: Reference, last_step: int) -> float:
    """min over u(0…last_step) ∈ U of max_k |x_r(k+1) − f(x_r(k), u(k))|_∞: zero (to solver accuracy) where followable.

    In the unit of the states: how far, at the least, the system falls off the reference in some step.
    """
    states = reference.state(np.arange(last_step + 2, dtype=float))
    drift, gain = reference.plant.system.affine(states[:-1])
    H, h = reference.plant.input_set.inequalities
    u = cp.Variable((last_step + 1, gain.shape[-1]))
    pushed = [cp.sum(cp.multiply(gain[:, i], u), axis=1) for i in range(gain.shape[1])]
    gap = states[1:] - drift - cp.vstack(pushed).T
    program = cp.Problem(cp.Minimize(cp.max(cp.abs(gap))), [u @ H.T <= np.tile(h, (last_step + 1, 1))])
    program.solve(solver=cp.CLARABEL)
    return float(program.value)
