"""The least d of given values, by a dense program in x_0 and the inputs alone: a second implementation."""

import numpy as np
import scipy

from trackably.reference.feasibility import Steps


def states_by_unknowns(steps: Steps) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Return F_k and f_k of x_k = F_k (x_0, u_0, u_1, …) + f_k."""
    system = steps.plant.linear
    n, m = system.B.shape
    F, f = [np.hstack([np.eye(n), np.zeros((n, m * steps.count))])], [np.zeros(n)]
    for k in range(steps.count - 1):
        moved = system.A @ F[-1]
        moved[:, n + m * k : n + m * (k + 1)] += system.B
        F.append(moved)
        f.append(system.A @ f[-1] + system.c)
    return F, f


def missing(steps: Steps, elastic: np.ndarray) -> float:
    """Return the least d; infinity where there is none."""
    n, m = steps.plant.linear.B.shape
    F, f = states_by_unknowns(steps)
    everything = [np.vstack([of, np.eye(m, of.shape[1], n + m * k)]) for k, of in enumerate(F)]
    all_rows = steps.rows.toarray() @ np.vstack(everything)
    at = steps.rows.toarray() @ np.concatenate([np.append(of, np.zeros(m)) for of in f])
    by = elastic[:, None]
    found = scipy.optimize.linprog(
        np.append(np.zeros(all_rows.shape[1]), 1.0),
        A_ub=np.block([[all_rows, -by], [-all_rows, -by]]),
        b_ub=np.concatenate([steps.upper - at, at - steps.lower]),
        bounds=[(None, None)] * all_rows.shape[1] + [(0, None)],
        method="highs-ipm",
    )
    return np.inf if found.x is None else float(found.fun)
