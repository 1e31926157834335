"""Fewer kernels are the same function up to rounding, and float64 evaluates them more accurately."""

import numpy as np
import pytest

from trackably.gp.compact import compact, within_a_period
from trackably.gp.kernels.base import Kernel
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.kernels.rational_quadratic import RationalQuadratic
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.signal import KernelSum


def long_at_bounds(kernel: Kernel) -> KernelSum:
    """Return a function as bounds of an acceleration make it: second differences at a hundred places."""
    rng, step = np.random.default_rng(0), 0.01
    places, weights = np.sort(rng.uniform(-10, 20, 100)), rng.uniform(0, 1, 100) / step**2
    centres = np.concatenate([places, places + step, places + 2 * step])
    return KernelSum.of_terms(kernel, 0.3, centres, np.concatenate([weights, -2 * weights, weights + 1]))


@pytest.mark.parametrize(
    "kernel", [SquaredExponential(1.5, 2.0), RationalQuadratic(1.5, 6.0, 2.0), Periodic(1.5, 0.4, 9.0)]
)
def test_the_function_stays_the_same_with_half_the_kernels_at_most(kernel):
    given = long_at_bounds(kernel)
    found, t = (within_a_period if kernel.period else compact)(given), np.linspace(-30, 40, 3001)
    size = np.sum(np.abs(given.weights)) * kernel(0.0)
    assert len(found.centres) <= len(given.centres) // 2
    assert np.sum(np.abs(found.weights)) < np.sum(np.abs(given.weights)) / 20  # float64 evaluates it more accurately
    np.testing.assert_allclose(found(t), given(t), rtol=0, atol=1e-14 * size)
    np.testing.assert_allclose(found.derivative(t), given.derivative(t), rtol=0, atol=1e-12 * size)
