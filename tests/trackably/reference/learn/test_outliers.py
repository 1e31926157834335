"""A few samples far off all others are asked about; noise, however it is spread, is not."""

import numpy as np
import pytest

from tests.trackably.plants import AXIS, moved
from trackably import DoubtfulInputWarning, Samples, SquaredExponential, learn_reference
from trackably.checker.certificate import Window
from trackably.reference.input_warnings import doubts, warn_about


def noisy(count: int) -> tuple[np.ndarray, np.ndarray]:
    times = np.linspace(0, 3, count)
    return times, moved(times) + 0.005 * np.random.default_rng(1).standard_normal(count)


def asked(values: np.ndarray) -> list[str]:
    samples = Samples(np.arange(len(values)) * 0.1, values)
    return [*doubts(Window(0.0, float(samples.times[-1])), {"x": samples}, AXIS)]


@pytest.mark.parametrize(("count", "lost", "centres"), [(61, 20, None), (601, 247, 100)])
def test_one_sample_elsewhere_is_asked_about_by_its_own_value_and_time(count, lost, centres):
    """Not by those of a centre that stands for it."""
    times, values = noisy(count)
    values[lost] += 0.15
    with pytest.warns(DoubtfulInputWarning) as caught:
        learn_reference(Samples(times, values), AXIS, SquaredExponential(), "all_times", centres=centres, starts=1)
    (said,) = (str(warned.message) for warned in caught)
    assert said.startswith(f"samples: position is {values[lost]:.6g} at {times[lost]:.6g} s, beside ")
    assert said.endswith("is it an outlier to be left out?")


def test_a_jump_is_no_outlier():
    """Before and after it, samples are far off a smooth curve, but no further out than their neighbours."""
    t = np.arange(-19.5, 20.0)
    assert asked(np.sign(t) + 0.001 * np.random.default_rng(0).standard_normal(40)) == []


@pytest.mark.parametrize("n", [10, 1000])
def test_noise_is_not_asked_about(n):
    """Normal, uniform, of two values, with tails, and quantised to a step that most samples share."""
    rng = np.random.default_rng(n)
    normal = rng.standard_normal(n)
    for off in (normal, rng.uniform(-1, 1, n), np.sign(normal), rng.laplace(size=n), np.round(normal / 2)):
        assert asked(off) == []


def test_samples_near_the_largest_number_are_asked_about_too():
    values = np.where(np.arange(20) == 7, -1.7e308, np.sin(np.arange(20)))
    values[12] = 1.7e308
    with pytest.warns(DoubtfulInputWarning, match=r"e\+308 at"):
        warn_about(doubts(Window(0.0, 1.9), {"x": Samples(np.arange(20) * 0.1, values)}, AXIS), 1)


@pytest.mark.parametrize("size", [0.3, 0.5, 1.0])
def test_two_outliers_do_not_hide_each_other(size):
    """Each is 20 times the noise, or more; a fit of all samples would take them for more noise."""
    values = np.sin(0.1 * np.arange(100)) + 0.015 * np.random.default_rng(2).standard_normal(100)
    values[[30, 75]] += size
    assert len(asked(values)) == 1
