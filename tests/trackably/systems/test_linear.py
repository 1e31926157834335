"""Linear systems: what may be left out, and exact discretisation against SciPy."""

import numpy as np
import pytest
from scipy.signal import cont2discrete

from tests.trackably.gp.instances import over
from trackably.systems.linear import LinearSystem

A2, B2 = np.array([[0.0, 1.0], [-2.0, -3.0]]), np.array([[0.0], [1.0]])


def test_a_number_in_the_third_place_is_the_sampling_time_and_a_list_is_c():
    assert LinearSystem(A2, B2, 0.1).sampling_time == 0.1
    np.testing.assert_array_equal(LinearSystem(A2, B2, [1.0, 2.0], sampling_time=0.1).c, [1.0, 2.0])
    with pytest.raises(ValueError, match="system: c must have shape"):
        LinearSystem(A2, B2, 0.1, sampling_time=0.2)


CONTINUOUS = {
    "damped": (A2, B2, np.zeros(2)),
    "integrators": (np.array([[0.0, 1.0], [0.0, 0.0]]), B2, np.array([0.3, -9.81])),
    "unstable": (np.array([[1.0, 2.0], [0.5, -1.0]]), np.array([[1.0, 0.0], [0.3, 2.0]]), np.array([0.1, 0.2])),
}


@over(CONTINUOUS, "system")
@pytest.mark.parametrize("sampling_time", [0.01, 0.5, 3.0])
def test_discretised_as_scipy_does(system, sampling_time):
    """Drift enters as one more input, held at one."""
    A, B, c = system
    n, m = B.shape
    found = LinearSystem.discretised(A, B, sampling_time, c)
    wider = np.hstack([B, c[:, None]])
    discrete, held, *_ = cont2discrete((A, wider, np.eye(n), np.zeros((n, m + 1))), sampling_time)
    np.testing.assert_allclose(found.A, discrete, rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(found.B, held[:, :m], rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(found.c, held[:, m], rtol=1e-12, atol=1e-13)


def test_inputs_that_push_alike_do_so_when_discretised():
    """Multiples by ± 2^k exactly, and other ones up to rounding."""
    A = np.random.default_rng(0).normal(size=(3, 3))
    b, other = A @ np.array([1.0, 0.3, -0.2]), np.array([0.1, 0.0, 1.0])
    B = LinearSystem.discretised(A, np.column_stack([b, other, -b, b / 4, 3 * b, b + other, 0 * b]), 0.1).B.T
    np.testing.assert_array_equal(B[[2, 3]], [-B[0], B[0] / 4])
    np.testing.assert_allclose(B[4:], [3 * B[0], B[0] + B[1], 0 * B[0]], atol=1e-15)
