"""Decide trackability by its definition (Definition 1 of the paper): do admissible inputs exist?

This is an independent check: a convex program searches for the inputs, and the dynamics are not solved for them.
"""

import cvxpy as cp
import numpy as np

from trackably.systems.reference import Reference


def smallest_defect(reference: Reference, last_step: int) -> float:
    """Return min over u(0…last_step) ∈ U of max_k |x_r(k+1) − f(x_r(k), u(k))|_∞, in the unit of the states.

    It is zero, up to the accuracy of the solver, if and only if the system can follow the reference.
    """
    states = reference.state(np.arange(last_step + 2, dtype=float))
    drift, gain = reference.plant.system.affine(states[:-1])
    H, h = reference.plant.input_set.inequalities
    u = cp.Variable((last_step + 1, gain.shape[-1]))
    by_input = [cp.sum(cp.multiply(gain[:, i], u), axis=1) for i in range(gain.shape[1])]
    gap = states[1:] - drift - cp.vstack(by_input).T
    program = cp.Problem(cp.Minimize(cp.max(cp.abs(gap))), [u @ H.T <= np.tile(h, (last_step + 1, 1))])
    program.solve(solver=cp.CLARABEL)
    return float(program.value)
