"""Long sums of kernels: the same as a naive sum, in any order of the centres, from nearby centres only."""

import numpy as np
import pytest

from trackable.gp.kernels.squared_exponential import SquaredExponential
from trackable.gp.signal import KernelSum

SPAN = 200.0  # seconds: many times the reach of the kernel
KERNEL = SquaredExponential(1.3, 0.7)


def centres(order: str) -> np.ndarray:
    """Times of 600 samples and the instants 0.1 s after them."""
    rng = np.random.default_rng(1)
    times = np.sort(rng.uniform(0.0, SPAN, 600))
    both = np.concatenate([times, times + 0.1])
    return {"in order": np.sort(both), "lag by lag": both, "shuffled": rng.permutation(both)}[order]


@pytest.mark.parametrize("order", ["in order", "lag by lag", "shuffled"])
def test_long_sums_are_those_of_nearby_centres_in_any_order(order, monkeypatch):
    at, t = centres(order), np.linspace(-5.0, SPAN + 5.0, 3001)
    weights = np.random.default_rng(2).standard_normal(len(at))
    expected = np.array([KERNEL.jet(s - at, 2) @ weights for s in t]).T
    expected[0] += 0.2
    evaluated, correlation = [], SquaredExponential.correlation

    def counted(kernel, s, order):
        evaluated.append(s.size)
        return correlation(kernel, s, order)

    monkeypatch.setattr(SquaredExponential, "correlation", counted)
    found = KernelSum(KERNEL, 0.2, at, weights).jet(t, 2)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-11)
    assert sum(evaluated) < t.size * len(at) / 4, "most centres are out of reach"
