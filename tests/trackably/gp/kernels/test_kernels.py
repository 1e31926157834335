"""What every stationary covariance is: positive semi-definite."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tests.trackably.gp.instances import kernels


@given(kernels, st.lists(st.floats(-50, 50), min_size=2, max_size=12))
def test_gram_matrix_of_any_times_is_positive_semidefinite(kernel, times):
    t = np.array(times)
    assert np.linalg.eigvalsh(kernel(t[:, None] - t))[0] > -1e-12 * kernel(np.zeros(()))
