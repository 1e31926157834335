"""Trackability taken at its word (Definition 1 of the paper): do admissible inputs exist?

A second opinion that never solves the dynamics for the input: a convex program looks for the inputs instead.
"""

import cvxpy as cp
import numpy as np

from pipeline.systems.reference import Reference


def smallest_defect(reference: Reference, last_step: int) -> float:
    """min over u(0…last_step) ∈ U of max_k |x_r(k+1) − f(x_r(k), u(k))|_∞: zero (to solver accuracy) where followable.

    In the unit of the states: how far, at the least, the system falls off the reference in some step.
    """
    states = reference.state(np.arange(last_step + 2, dtype=float))
    system, (H, h) = reference.plant.system, reference.plant.input_set.inequalities
    u = cp.Variable((last_step + 1, system.B.shape[1]))
    gap = (states[1:] - states[:-1] @ system.A.T - system.c) - u @ system.B.T
    program = cp.Problem(cp.Minimize(cp.max(cp.abs(gap))), [u @ H.T <= np.tile(h, (last_step + 1, 1))])
    program.solve(solver=cp.CLARABEL)
    return float(program.value)
