"""Sums of kernels at one time are bounded by the weights nearby."""

import numpy as np
import pytest

from tests.trackably.checker.kernels.instances import checked
from tests.trackably.gp.instances import REPRESENTATIVE, over
from trackably.checker.rounding import largest_sums
from trackably.checker.subject import Signal
from trackably.gp.kernels.matern import Matern52

TIMES = {
    "one": lambda rng: np.array([2.5]),
    "the same": lambda rng: np.full(3, -1e3),
    "few": lambda rng: rng.uniform(0, 9, 7),
    "clusters": lambda rng: np.sort(8.0 * rng.integers(0, 5, 90) + rng.uniform(0, 0.01, 90)),
    "even": lambda rng: -30 + 0.1 * np.arange(600),
}


@over(REPRESENTATIVE)
@pytest.mark.parametrize("times", TIMES.values(), ids=TIMES)
def test_no_time_has_a_larger_sum(kernel, times) -> None:
    rng, own = np.random.default_rng(4), checked(kernel)
    centres = times(rng)
    weights = rng.standard_normal(len(centres)) * 10.0 ** rng.uniform(-3, 3, len(centres))
    found = largest_sums(Signal(own, 0.0, tuple(centres.tolist()), tuple(weights.tolist())))
    t = np.unique([*centres, *np.linspace(min(centres) - 9, max(centres) + 9, 2000)])
    jets = np.abs(kernel.jet(t[:, None] - centres, 1)) @ np.abs(weights)
    for bound, sums, peak in zip(found, jets, own.peak, strict=True):
        assert np.max(sums) <= float(bound.b) * (1 + 1e-12)
        assert float(bound.b) <= np.sum(np.abs(weights)) * float(peak.b) * (1 + 1e-12)


def test_a_longer_recording_has_no_larger_sums() -> None:
    """Of centres at one rate, only those within the kernel's memory count."""
    kernel = Matern52(1.0, 1.6)
    sizes = [
        float(largest_sums(Signal(checked(kernel), 0.0, tuple((0.1 * np.arange(n)).tolist()), (1.0,) * n)).size.b)
        for n in (400, 4000)
    ]
    of_all = float(np.sum(kernel(0.1 * np.arange(-2000, 2000))))
    assert of_all <= sizes[1] < min(3 * of_all, 1.5 * sizes[0])
