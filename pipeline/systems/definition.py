"""Trackability taken at its word (Definition 1 of the paper): do admissible inputs exist?

A second opinion that never solves the dynamics for the input: a convex program looks for the inputs instead.
"""

import cvxpy as cp
import numpy as np

from pipeline.systems.reference import Reference


def smallest_defect(reference: Reference, last_step: int) -> float:
    """min over u(0…last_step) ∈ U of max_k |x_r(k+1) − f(x_r(k), u(k))|: zero (to solver accuracy) where followable.

    In the unit of the state: how far, at the least, the system falls off the reference in some step.
    """
    states = reference.state(reference.instants(np.arange(last_step + 2, dtype=float)))
    system, inputs = reference.plant.system, reference.plant.input_set
    u = cp.Variable(last_step + 1)
    gap = states[1:] - (system.a * states[:-1] + system.b * u + system.c)
    program = cp.Problem(cp.Minimize(cp.max(cp.abs(gap))), [u >= inputs.lower, u <= inputs.upper])
    program.solve(solver=cp.CLARABEL)
    return float(program.value)
