"""What every stationary covariance is: symmetric, positive semi-definite, a function of the difference of times."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tests.trackably.gp.instances import KERNELS, PERIODIC, kernels, over, time_scale
from trackably.gp.kernels.base import Kernel, Product, Sum


def gram(kernel: Kernel, t):
    return kernel(t[:, None] - t)


def smallest_eigenvalue(kernel: Kernel, t) -> float:
    """… in units of the signal variance."""
    return float(np.linalg.eigvalsh(gram(kernel, t))[0]) / float(kernel(np.zeros(())))


def variance_at_zero(kernel: Kernel) -> float:
    match kernel:
        case Sum(left, right):
            return variance_at_zero(left) + variance_at_zero(right)
        case Product(left, right):
            return variance_at_zero(left) * variance_at_zero(right)
    return kernel.hyperparameters["signal_std"] ** 2


@over(KERNELS)
def test_is_symmetric_in_time(kernel):
    r = np.linspace(0, 4 * time_scale(kernel), 101)
    np.testing.assert_array_equal(kernel(r), kernel(-r))
    even = np.array([1, -1, 1, -1])[:, None]
    scale = np.max(np.abs(kernel.jet(r, 3)), axis=1, keepdims=True)
    np.testing.assert_allclose(kernel.jet(r, 3) / scale, even * kernel.jet(-r, 3) / scale, atol=1e-13)


@over(KERNELS)
def test_gram_matrix_is_positive_semidefinite(kernel):
    t = np.random.default_rng(1).uniform(0, 3 * time_scale(kernel), 40)
    assert smallest_eigenvalue(kernel, t) > -1e-13 * t.size


@given(kernels, st.lists(st.floats(-50, 50), min_size=2, max_size=12))
def test_gram_matrix_of_any_times_is_positive_semidefinite(kernel, times):
    assert smallest_eigenvalue(kernel, np.array(times)) > -1e-12


@over(KERNELS)
def test_value_and_gradient_are_those_of_the_jet(kernel):
    r = np.linspace(-3, 3, 61) * time_scale(kernel)
    value, gradient = kernel.value_and_gradient(r)
    jet, by_theta = kernel.jet_and_gradient(r, 0)
    np.testing.assert_allclose(value, jet[0], rtol=1e-13, atol=1e-300)
    np.testing.assert_allclose(kernel.value(r), jet[0], rtol=1e-13, atol=1e-300)
    np.testing.assert_allclose(kernel.value(r[0]), jet[0, 0], rtol=1e-13, atol=1e-300)
    np.testing.assert_allclose(gradient, by_theta[:, 0], rtol=1e-12, atol=1e-13 * variance_at_zero(kernel))


@over(PERIODIC)
def test_periodic_repeats_with_its_period(kernel):
    r = np.linspace(-1, 1, 31) * kernel.period
    scale = np.max(np.abs(kernel.jet(r, 3)), axis=1, keepdims=True)
    for periods in (1, 2, -5):
        np.testing.assert_allclose(
            kernel.jet(r + periods * kernel.period, 3) / scale, kernel.jet(r, 3) / scale, atol=1e-12
        )
