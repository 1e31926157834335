"""Bounds from some time on: they hold at every later time, and say nothing where nothing is known."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.published.algorithm1 import Tail, decay_distance, tail
from pipeline.published.scalar import scalar, state_and_input
from tests.trackably.gp.instances import KERNELS, decaying_kernels, over, time_scale
from tests.trackably.systems.instances import PLANTS
from trackably.gp.signal import KernelSum
from trackably.systems.intervals import Interval


def random_signal(kernel, seed: int) -> KernelSum:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 9))
    centres = np.sort(rng.uniform(-2, 2, n)) * time_scale(kernel)
    return KernelSum(kernel, float(rng.normal()), centres, rng.normal(size=n) * 10 ** rng.uniform(-2, 2))


def later_than(start: float, signal: KernelSum):
    scale = time_scale(signal.kernel)
    return start + scale * np.concatenate([np.linspace(0, 3, 1500), np.geomspace(3, 300, 200)])


@given(decaying_kernels, st.sampled_from([*PLANTS.values()]), st.integers(0, 10**6), st.floats(1.001, 10))
def test_bounds_of_any_signal_and_of_its_input_hold_at_every_later_time(kernel, plant, seed, factor):
    signal = random_signal(kernel, seed)
    start = float(np.max(signal.centres)) + factor * decay_distance(kernel)
    bounds, times, size = tail(signal, start), later_than(start, signal), float(np.sum(np.abs(signal.weights)))
    rounding = 1e-13 * size * float(kernel(np.zeros(())))
    assert np.all(np.abs(signal(times) - signal.mean) <= bounds.mean_bound + rounding + 1e-15 * abs(signal.mean))
    per_second = rounding / min(1.0, decay_distance(kernel))
    assert np.all(np.abs(signal.derivative(times)) <= bounds.derivative_bound + per_second)
    ends, u = bounds.inputs(plant), state_and_input(plant)[1]((signal,), times)
    assert np.min(ends.margin(u)) >= -1e-12 * (1 + np.max(np.abs(u)) + size)


@pytest.mark.parametrize(
    ("low", "high", "keeps"), [(-1, 0.5, True), (-1, 0.4, False), (-0.5, 1, True), (-0.4, 1, False)]
)
def test_both_tests_ask_both_sides(low, high, keeps):
    """A bound of 0.5 around 0, a rate of 2: each side of each may be where it is touched, and no nearer."""
    plant = scalar(0.9, 0.5, state_set=Interval(low, high), input_set=Interval(-1, 1), sampling_time=0.1)
    assert Tail(0.0, 0.0, 0.5, 1.0).keeps_states(plant) is keeps
    assert Tail(0.0, 0.0, 1.0, derivative_bound=2.0).keeps_rates((4 * low, 4 * high)) is keeps
    assert not Tail(0.0, 0.7, 0.5, 1.0).keeps_states(plant)


@over(KERNELS)
def test_bounds_begin_where_the_last_sample_is_farther_back_than_the_kernel_takes_to_decay(kernel):
    """What repeats never does."""
    zeta = min(decay_distance(kernel), 1e5)
    signal = KernelSum(kernel, 0.0, np.array([0.0, 10 * zeta]), np.array([1.0, 1.0]))
    known = [tail(signal, factor * zeta) is not None for factor in (5, 10.999, 11.001)]
    assert known == [False, False, np.isfinite(decay_distance(kernel))]
