"""Evaluation block by block against the whole."""

import numpy as np
import pytest

from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.signal import KernelSum

CENTRES = 0.3 + 0.04 * np.arange(150)
WEIGHTS = np.random.default_rng(2).standard_normal(150)


@pytest.mark.parametrize("shape", [(60_000,), (20_000, 3)])
@pytest.mark.parametrize("step", [0.01, 0.01 / np.pi])
def test_many_times_of_any_shape(shape, step):
    """Beyond what is held at once, regular or not: the same numbers as one by one."""
    kernel = SquaredExponential(1.3, 0.4)
    signal = KernelSum(kernel, 0.7, CENTRES, WEIGHTS)
    t = step * np.arange(np.prod(shape)).reshape(shape)
    places = np.random.default_rng(0).integers(0, t.size, 50)
    jet = signal.jet(t, 1)
    assert jet.shape == (2, *shape)
    np.testing.assert_allclose(jet.reshape(2, -1)[:, places], signal.jet(t.flat[places], 1), rtol=0, atol=1e-12)
    np.testing.assert_array_equal(signal(t)[..., -1], signal.jet(t, 0)[0, ..., -1])
