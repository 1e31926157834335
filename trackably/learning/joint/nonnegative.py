"""Convex quadratic programs over x ≥ 0 with many variables, most of them positive at the minimum."""

import numpy as np
import scipy

from trackably.arrays import Array, Flags

_MOST_EXCHANGES, _MOST_STEPS = 60, 30  # steps: for each variable
_PATIENCE = 3  # exchanges of all variables that do not lead to fewer wrong ones
_ROUNDING = 2 * float(np.finfo(float).eps)


def nonnegative_minimum(G: Array, b: Array, likely: Flags | None = None) -> Array:
    """Return argmin xᵀ G x − 2 bᵀ x over x ≥ 0, shape (r,), for G (r, r) positive definite with a diagonal near 1.

    The search begins with the variables that are `likely` positive, shape (r,). Raises LinAlgError where a matrix on
    the way has no Cholesky factor, and RuntimeError where the minimum is not found in float64.
    """
    found = _pivoted(G, b, np.zeros(len(b), dtype=bool) if likely is None else likely)
    return _by_single_steps(G, b) if found is None else found


def _pivoted(G: Array, b: Array, positive: Flags) -> Array | None:
    """Return the x ≥ 0 with y = G x − b ≥ 0 and xᵀ y = 0; None where it is not found in `_MOST_EXCHANGES`.

    Block principal pivoting: the equations y = 0 are solved for the `positive` variables, and all that are wrong are
    exchanged together, those with x < 0 and those with y < 0. Where that does not help, one is exchanged at a time
    (Júdice and Pires 1994: A block principal pivoting algorithm for large-scale strictly monotone linear
    complementarity problems, Computers and Operations Research 21). y counts as zero within the rounding of G x.
    """
    fewest, patience = len(b) + 1, _PATIENCE
    for _ in range(_MOST_EXCHANGES):
        x, y = np.zeros(len(b)), -b
        if positive.any():
            _, x[positive], not_positive = scipy.linalg.lapack.dposv(G[positive][:, positive], b[positive], lower=1)
            if not_positive:
                raise np.linalg.LinAlgError("a matrix on the way has no Cholesky factor")
            y = G[:, positive] @ x[positive] - b
        rounding = _ROUNDING * (np.abs(x).sum() + np.abs(b))
        wrong = np.where(positive, x < 0, y < -rounding)
        count = int(np.count_nonzero(wrong))
        if not count:
            return x
        if count < fewest:
            fewest, patience = count, _PATIENCE
        elif patience:
            patience -= 1
        else:
            wrong[: np.flatnonzero(wrong)[-1]] = False
        positive = positive ^ wrong
    return None


def _by_single_steps(G: Array, b: Array) -> Array:
    """Return the same by an active-set method with one more positive variable in each step (Lawson and Hanson).

    It is the least squares problem min ‖Rᵀ x − R⁻¹ b‖ with G = R Rᵀ: slower where many are positive, and hardly ever
    lost.
    """
    R = scipy.linalg.cholesky(G, lower=True)
    found, _ = scipy.optimize.nnls(R.T, scipy.linalg.solve_triangular(R, b, lower=True), maxiter=_MOST_STEPS * len(b))
    return np.asarray(found)
