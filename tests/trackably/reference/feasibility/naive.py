"""The least d of given values, by a dense program in x_0 and the inputs alone: a second implementation."""

import numpy as np
import scipy

from trackably.reference.feasibility import Steps


def missing(steps: Steps, elastic: np.ndarray) -> float:
    """Return the least d; infinity where there is none."""
    system = steps.plant.linear
    n, m = system.B.shape
    x, stacked = np.eye(n, n + m * steps.count + 1), []  # of x_0, of all inputs, and of 1
    for k in range(steps.count):
        u = np.eye(m, x.shape[1], n + m * k)
        stacked += [x, u]
        x = system.A @ x + system.B @ u
        x[:, -1] += system.c
    affine, by = steps.rows @ np.vstack(stacked), elastic[:, None]
    rows, at = affine[:, :-1], affine[:, -1]
    found = scipy.optimize.linprog(
        np.append(np.zeros(rows.shape[1]), 1.0),
        A_ub=np.block([[rows, -by], [-rows, -by]]),
        b_ub=np.concatenate([steps.upper - at, at - steps.lower]),
        bounds=[(None, None)] * rows.shape[1] + [(0, None)],
        method="highs-ipm",
    )
    return np.inf if found.x is None else float(found.fun)
