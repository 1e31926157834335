"""The dual's solver where a row is zero: `test_optimal.py` has all other programs."""

import numpy as np
import pytest

from trackably.learning.joint.dual import solve_dual


def test_a_row_that_no_vector_moves_keeps_its_bounds_or_contradicts_them():
    """A quantity that the samples determine, or that no process enters."""
    covariance, flags = np.diag([0.0, 1.0]), np.zeros(2, dtype=bool)
    kept = solve_dual(covariance, np.array([-0.5, 2.0]), flags)
    assert (kept.value, kept.contradicts) == (pytest.approx(4.0), False)
    assert solve_dual(covariance, np.array([0.5, 2.0]), flags).contradicts
