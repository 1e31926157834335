"""Where on its times a margin is smallest: steps against a loop over plateaus, continua against closed forms."""

import math
from itertools import groupby
from operator import itemgetter
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.published.periodic import GrowthRates, Values
from pipeline.published.scalar import scalar
from trackably.checker.certificate import Window
from trackably.gp.kernels.matern import Matern32
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.signal import KernelSum
from trackably.learning.constraint import Constraint, overlooked
from trackably.learning.index_set import RealTimes, Steps
from trackably.systems.intervals import Interval

KERNEL = SquaredExponential(1.0, 0.5)


def minima(index_set, margin, kernel=KERNEL, *others):
    return index_set.minima_of_each(Values((), (margin,)), [kernel, *others])[0][0]


def minima_of(values: list[float], first: int) -> list[int]:
    """Indices that `Steps` names for these margins."""
    steps = Steps(first, first + len(values) - 1, 0.5)
    times = minima(steps, lambda t: np.array(values)[np.rint(t / 0.5).astype(int) - first])
    return [round(t / 0.5) - first for t in times.tolist()]


def plateaus(values: list[float]) -> list[tuple[int, int]]:
    """First and last index of each run of equal values that is lower than both of its neighbours."""
    runs = [[i for i, _ in run] for _, run in groupby(enumerate(values), key=itemgetter(1))]
    around = [math.inf, *values, math.inf]
    return [(run[0], run[-1]) for run in runs if values[run[0]] < min(around[run[0]], around[run[-1] + 2])]


@given(st.lists(st.integers(0, 3).map(float), min_size=1, max_size=30), st.integers(0, 5))
def test_every_lowest_plateau_is_named_once_by_its_first_step(values, first):
    named = minima_of(values, first)
    for begin, end in plateaus(values):
        assert [i for i in named if begin <= i <= end] == [begin]
    for i in named:
        assert values[i] <= min(values[max(i - 1, 0) : i + 2])
    assert min(values[i] for i in named) == min(values)


@pytest.mark.parametrize("index_set", [Steps(3, 4002, 3 / 4000), Steps(3, 60_002, 5e-5), RealTimes(Window(0.0, 3.0))])
@pytest.mark.parametrize("lengthscale", [0.05, 0.4])
def test_minima_of_a_signal_are_those_of_a_dense_look(index_set, lengthscale):
    """Each, up to a part of its depth that no back-off is as small as."""
    rng = np.random.default_rng(0)
    signal = KernelSum(SquaredExponential(1.0, lengthscale), 0.0, np.sort(rng.uniform(0, 3, 60)), rng.normal(size=60))
    times, rounding = np.linspace(0, 3, 300_001), 1e-7
    if isinstance(index_set, Steps):
        times, rounding = np.arange(index_set.first, index_set.last + 1) * index_set.sampling_time, 1e-10
    values = signal(times)
    low = np.flatnonzero((values[1:-1] < values[:-2]) & (values[1:-1] <= values[2:])) + 1
    found = minima(index_set, signal, signal.kernel)
    assert set(found) <= set(times) or isinstance(index_set, RealTimes)
    nearest = found[np.argmin(np.abs(found[:, None] - times[low]), axis=0)]
    np.testing.assert_allclose(nearest, times[low], rtol=0, atol=2e-5)
    np.testing.assert_allclose(signal(nearest), values[low], rtol=0, atol=rounding)
    assert np.min(signal(found)) <= np.min(values) + 1e-12


@given(st.floats(-3, 3), st.floats(0.1, 10), st.floats(-0.5, 1.5))
def test_a_window_finds_the_bottom_of_a_bowl_or_the_nearer_end(start, length, where):
    bottom = start + where * length
    found = minima(RealTimes(Window(start, start + length)), lambda t: (t - bottom) ** 2)
    np.testing.assert_allclose(found, [np.clip(bottom, start, start + length)], atol=1e-6 * length)


def test_the_fastest_of_several_kernels_decides_how_closely_to_look():
    """A narrow dip beside a long one, whichever kernel comes first."""
    fast, slow = SquaredExponential(1.0, 0.002), SquaredExponential(1.0, 5.0)

    def margin(t):
        return (t - 2.0) ** 2 - 5 * np.exp(-(((t - 0.5031) / 0.004) ** 2))

    for kernels in ([fast, slow], [slow, fast]):
        found = minima(RealTimes(Window(0.0, 3.0)), margin, *kernels)
        assert np.min(np.abs(found - 0.5031)) < 1e-4


def test_between_the_centres_of_a_rough_sum_nothing_is_overlooked():
    """The kernel's correlation time is 10 s, but the signal goes up and down from centre to centre, a second apart."""
    kernel, centres, signs = Matern32(1.0, 17.0), np.arange(61.0), (-1.0) ** np.arange(61)
    waves = KernelSum(kernel, 0.0, centres, np.linalg.solve(kernel(centres[:, None] - centres), signs))
    plant = scalar(1.0, 1.0, state_set=Interval(-0.8, 2.0), input_set=Interval(-9.0, 9.0), sampling_time=0.1)
    sets = RealTimes(Window(10.2, 49.9)), GrowthRates(plant, (0.0, 60.0))
    (times, margins), (pairs, _) = overlooked(
        [*map(Constraint, plant.quantities, sets)], SimpleNamespace(signals=(waves,))
    )
    assert pairs.shape == (0, 2)
    assert np.all(margins < 0)
    assert {round(t) for t in times.tolist()} == set(range(11, 50, 2))
