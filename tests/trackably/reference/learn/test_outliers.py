"""A few samples far off a fit of all others are asked about; noise, however it is spread, is not."""

from functools import partial

import numpy as np
import pytest

from tests.trackably.plants import AXIS, moved
from trackably import DoubtfulInputWarning, Samples, SquaredExponential, learn_reference
from trackably.reference.explanation import outlying
from trackably.reference.fit import Misfit

LEARN = partial(learn_reference, plant=AXIS, kernel=SquaredExponential(), claim="all_times", starts=1)


def noisy(count: int) -> tuple[np.ndarray, np.ndarray]:
    times = np.linspace(0, 3, count)
    return times, moved(times) + 0.005 * np.random.default_rng(1).standard_normal(count)


def asked(off: np.ndarray, noise_std: float, values: np.ndarray) -> list[str]:
    samples = Samples(np.arange(len(off)), values)
    return [*outlying([Misfit("x", samples, off, off, noise_std, noise_std, True)])]


@pytest.mark.parametrize(("count", "lost", "centres"), [(61, 20, None), (601, 247, 100)])
def test_one_sample_elsewhere_is_asked_about_by_its_own_value_and_time(count, lost, centres):
    """Not by those of a centre that stands for it."""
    times, values = noisy(count)
    values[lost] += 0.15
    with pytest.warns(DoubtfulInputWarning) as caught:
        LEARN(Samples(times, values), centres=centres)
    (said,) = (str(warned.message) for warned in caught)
    assert said.startswith(f"samples: position is {values[lost]:.6g} at {times[lost]:.6g} s, ")
    assert said.endswith("is it an outlier to be left out? It raises the noise that is learned")


def test_a_jump_is_no_outlier():
    """Before and after it, samples are far off a smooth fit, but no further out than their neighbours."""
    t = np.arange(-19.5, 20.0)
    values = np.sign(t) + 0.001 * np.random.default_rng(0).standard_normal(40)
    assert asked(np.sign(t) * np.exp(-np.abs(t)), 0.1, values) == []


@pytest.mark.parametrize("n", [10, 1000])
def test_noise_is_not_asked_about(n):
    """Normal, uniform, of two values, with tails, and quantised to a step that most samples share."""
    rng = np.random.default_rng(n)
    normal = rng.standard_normal(n)
    for off in (normal, rng.uniform(-1, 1, n), np.sign(normal), rng.laplace(size=n), np.round(normal / 2)):
        assert asked(off, float(np.std(off)), off) == []


def test_two_outliers_do_not_hide_each_other():
    """Two equal outliers among 40 samples raise the learned noise to a fifth of their size, or more."""
    off = 0.01 * np.cos(np.arange(40.0))
    off[[10, 25]] += 1.0
    assert asked(off, float(np.std(off)), off)
