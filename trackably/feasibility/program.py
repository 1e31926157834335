"""By how much bounds or given values would have to give way so that some sequence satisfies them: a linear program."""

from dataclasses import dataclass

import numpy as np
import scipy

from trackably.arrays import Array
from trackably.feasibility.steps import Steps


@dataclass(frozen=True, eq=False)
class Least:
    """The least d ≥ 0 for which a sequence has every row between lower - d `elastic` and upper + d `elastic`.

    `at_lower` and `at_upper` are multipliers λ ≥ 0 of the rows, in their own units. `missing` is d up to the solver's
    tolerance: what is certain of it, `certainly_missing` says.
    """

    steps: Steps
    elastic: Array
    missing: float
    at_lower: Array
    at_upper: Array


def least(steps: Steps, elastic: Array) -> Least | None:
    """Return the least d; None where there is none, as rows that are not elastic contradict each other.

    Unknowns and rows are divided by their widths, as tolerances of solvers are absolute.
    """
    widths, scales = steps.widths, np.tile(steps.scales, steps.count)
    rows = scipy.sparse.diags_array(1 / widths) @ steps.rows @ scipy.sparse.diags_array(scales)
    by = scipy.sparse.csr_array((elastic / widths)[:, None])
    dynamics, constant = _dynamics(steps)
    sides = [scipy.sparse.hstack([of, -by]) for of in (rows, -rows)]
    found = scipy.optimize.linprog(
        np.append(np.zeros(len(scales)), 1.0),
        A_ub=scipy.sparse.vstack(sides, format="csc"),
        b_ub=np.concatenate([steps.upper, -steps.lower]) / np.tile(widths, 2),
        A_eq=scipy.sparse.hstack([dynamics, scipy.sparse.csr_array((len(constant), 1))], format="csc"),
        b_eq=constant,
        bounds=[(-np.inf, np.inf)] * len(scales) + [(0.0, np.inf)],
        method="highs-ds",
    )
    if found.fun is None:
        return None
    at_upper, at_lower = np.split(np.maximum(-found.ineqlin.marginals, 0), 2) / widths
    return Least(steps, elastic, float(found.fun), at_lower, at_upper)


def _dynamics(steps: Steps) -> tuple[scipy.sparse.csr_array, Array]:
    """Return x_{k+1} - A x_k - B u_k = c for each step, in widths of the states."""
    system, scales = steps.plant.linear, steps.scales
    n, size, last = len(system.A), steps.size, steps.count - 1
    of_states = 1 / scales[:n, None]
    here = scipy.sparse.csr_array(-np.hstack([system.A, system.B]) * scales * of_states)
    there = scipy.sparse.csr_array(np.eye(n, size))
    every = scipy.sparse.eye_array
    rows = scipy.sparse.kron(every(last, last + 1), here) + scipy.sparse.kron(every(last, last + 1, k=1), there)
    return scipy.sparse.csr_array(rows), np.tile(system.c * of_states[:, 0], last)
