"""A few samples far off a fit of all others are asked about; noise, however it is spread, is not."""

import numpy as np
import pytest

from tests.trackably.plants import AXIS, moved
from trackably import DoubtfulInputWarning, Samples, SquaredExponential, learn_reference
from trackably.reference.explanation import outlying
from trackably.reference.fit import Misfit

TIMES = np.linspace(0, 3, 61)
NOISY = moved(TIMES) + 0.005 * np.random.default_rng(1).standard_normal(TIMES.size)


def asked(off: np.ndarray, noise_std: float, values: np.ndarray) -> list[str]:
    samples = Samples(np.arange(len(off)), values)
    return [*outlying([Misfit("x", samples, off, off, noise_std, noise_std, True)])]


@pytest.mark.parametrize("lost", [10, 20, 41])
def test_one_sample_elsewhere_is_asked_about(lost):
    values = NOISY.copy()
    values[lost] += 0.15
    with pytest.warns(DoubtfulInputWarning) as caught:
        learn_reference(Samples(TIMES, values), AXIS, SquaredExponential(), "all_times", starts=1)
    (said,) = (str(warned.message) for warned in caught)
    assert said.startswith(f"samples: position is {values[lost]:.6g} at {TIMES[lost]:.6g} s, ")
    assert said.endswith("is it an outlier to be left out? It raises the noise that is learned")


def test_so_is_one_of_many_that_fewer_centres_stand_for():
    """It is named by its own value and time, not by those of a centre."""
    times = np.linspace(0, 3, 601)
    values = moved(times) + 0.005 * np.random.default_rng(2).standard_normal(times.size)
    values[247] += 0.15
    with pytest.warns(DoubtfulInputWarning) as caught:
        found = learn_reference(Samples(times, values), AXIS, SquaredExponential(), "all_times", starts=1, centres=100)
    assert found.fit.condensed
    (said,) = (str(warned.message) for warned in caught)
    assert said.startswith(f"samples: position is {values[247]:.6g} at 1.235 s, 0.1")


def test_a_jump_is_no_outlier():
    """Before and after it, samples are far off a smooth fit, but no further out than their neighbours."""
    t = np.arange(-19.5, 20.0)
    values = np.sign(t) + 0.001 * np.random.default_rng(0).standard_normal(40)
    assert asked(np.sign(t) * np.exp(-np.abs(t)), 0.1, values) == []


def test_without_it_nothing_is_asked():
    learn_reference(Samples(TIMES, NOISY), AXIS, SquaredExponential(), "all_times", starts=1)


@pytest.mark.parametrize("n", [10, 100, 10_000])
def test_noise_is_not_asked_about(n):
    """Normal, uniform, of two values, with tails, and quantised to a step that most samples share."""
    rng = np.random.default_rng(n)
    normal = rng.standard_normal(n)
    for off in (normal, rng.uniform(-1, 1, n), np.sign(normal), rng.laplace(size=n), np.round(normal / 2)):
        assert asked(off, float(np.std(off)), off) == []
