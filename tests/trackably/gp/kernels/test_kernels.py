"""What every stationary covariance is: positive semi-definite, and the same however it is asked for."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tests.trackably.gp.instances import KERNELS, kernels, over, time_scale


@given(kernels, st.lists(st.floats(-50, 50), min_size=2, max_size=12))
def test_gram_matrix_of_any_times_is_positive_semidefinite(kernel, times):
    t = np.array(times)
    assert np.linalg.eigvalsh(kernel(t[:, None] - t))[0] > -1e-12 * kernel(np.zeros(()))


@over(KERNELS)
def test_the_value_for_searches_is_that_of_the_jet(kernel):
    r = np.linspace(-3, 3, 61) * time_scale(kernel)
    jet = kernel.jet(r, 0)
    np.testing.assert_allclose(kernel.value(r), jet[0], rtol=1e-13, atol=1e-300)
    np.testing.assert_allclose(kernel.value(r[0]), jet[0, 0], rtol=1e-13, atol=1e-300)
