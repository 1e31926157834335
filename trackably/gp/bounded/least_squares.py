"""Least squares whose unknowns are not negative."""

import numpy as np
import scipy

from trackably.arrays import Array

_MOST_STEPS = 30  # for each unknown: one step makes it positive or zero, and some do so again


def nonnegative_least_squares(matrix: Array, aim: Array) -> Array:
    """Return argmin ‖A x − b‖ over x ≥ 0, shape (n,), for `matrix` A (m, n) and `aim` b (m,).

    By the active-set method of C. L. Lawson and R. J. Hanson, Solving Least Squares Problems (1974), chapter 23. Raises
    LinAlgError where it does not end: rounding then makes it go round in circles.
    """
    steps = _MOST_STEPS * matrix.shape[1]
    try:
        found, _ = scipy.optimize.nnls(matrix, aim, maxiter=steps)
    except RuntimeError as error:
        raise np.linalg.LinAlgError(f"the active-set method does not end in {steps} steps") from error
    return np.asarray(found)
