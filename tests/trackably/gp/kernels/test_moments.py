"""Sums from moments are the direct sums."""

import numpy as np
import pytest

from trackably import Kernel, Matern32, Matern52
from trackably.gp.kernels.base import sum_by_moments

KERNELS = {
    "matern52": Matern52(1.3, 2.0),
    "short": Matern32(0.7, 0.01),
    "long": Matern52(1.0, 1e4),
    "sum": Matern52(1.0, 0.3) + Matern32(2.0, 30.0),
}


def direct(kernel: Kernel, centres: np.ndarray, weights: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The sum, and the sum of absolute values."""
    terms = kernel.jet(t[..., None] - centres, 2)
    return terms @ weights, np.abs(terms) @ np.abs(weights)


@pytest.mark.parametrize("name", KERNELS)
@pytest.mark.parametrize("seed", range(3))
def test_moments_give_the_direct_sum_up_to_its_rounding(name, seed):
    draw, kernel = np.random.default_rng(seed), KERNELS[name]
    centres = draw.uniform(0, 100, 257)
    centres[:20] = centres[20:40]  # repeated ones
    weights = draw.standard_normal(257) * 10.0 ** draw.uniform(-3, 6, 257)
    t = np.concatenate([draw.uniform(-20, 130, 90), centres[15:25]]).reshape(4, 25)  # before, after, at centres
    found = sum_by_moments(kernel.decays, centres, weights, t, 2)
    wanted, scale = direct(kernel, centres, weights, t)
    largest = scale.max(axis=(1, 2), keepdims=True)
    assert np.all(np.abs(found - wanted) <= 1e-14 * largest)
