"""`learn_reference` from outside: what it gives."""

import numpy as np
import pytest

from tests.trackably.gp import naive
from tests.trackably.plants import AXIS, CART, KERNEL, MOVED, SAMPLES, TIMES
from trackably import (
    DoubtfulInputWarning,
    Periodic,
    Proved,
    Samples,
    SquaredExponential,
    check,
    learn_reference,
)


@pytest.fixture(scope="module")
def axis():
    return learn_reference({"position": SAMPLES}, AXIS, KERNEL, "all_times", noise_std=0.02)


def test_the_system_follows_inside_its_sets(axis):
    k = np.arange(3000)
    states, inputs = axis.state(k), axis.input(k)
    assert (states.shape, inputs.shape) == ((3000, 2), (3000, 1))
    np.testing.assert_allclose(AXIS.system.successor(states[:-1], inputs[:-1]), states[1:], atol=1e-9)
    assert np.min(AXIS.state_set.margin(states)) >= 0
    assert np.min(AXIS.input_set.margin(inputs)) >= 0
    np.testing.assert_allclose(states[:60:4, 0], np.interp(k[:60:4] * 0.05, TIMES, MOVED), atol=0.15)


def test_deviations_are_those_of_the_states_that_many_draws_would_have(axis):
    """Of position (z + z⁺)/2, velocity and force, against the covariance of z at all times that are looked at."""
    step = 0.05
    covariance = naive.covariance(axis.prior.parts[0], axis.samples[0], 0.31 + step * np.arange(3))
    rows = np.array([[0.5, 0.5, 0], [-1 / step, 1 / step, 0], [1 / step**2, -2 / step**2, 1 / step**2]])
    expected = np.sqrt(np.diag(rows @ covariance @ rows.T))
    found = [axis.fit.posterior.parts[0].variance_of(row, step, np.array(0.31)) for row in rows]
    assert np.all(np.abs(np.sqrt(found) / expected - 1) < [1e-4, 1e-4, 1e-2])


def test_the_certificate_stands_alone(axis, tmp_path):
    (file,) = axis.save_certificate(tmp_path / "proof.json")
    assert isinstance(check(file), Proved)
    assert "proved for all real t ≥ 0" in axis.explanation


def test_what_is_not_proved_is_refused(axis):
    for ask in (axis.state, axis.input, lambda k: axis.window(k, 5)):
        with pytest.raises(ValueError, match=r"^step -1 \(-0.05 s\) is outside of what is proved, all real t ≥ 0"):
            ask(-1)
    assert axis.window(10**9, 3).states.shape == (4, 2)
    with pytest.raises(ValueError, match="window: horizon must be at least 1, got 0"):
        axis.window(3, 0)


def test_a_window_is_proved_and_nothing_else():
    up = Samples(TIMES, -0.9 + 0.3 * TIMES)
    found = learn_reference(up, AXIS, KERNEL, (0.0, 3.0), noise_std=0.02, mean=-5.0)
    assert "from 0 s to 3 s" in found.explanation
    assert np.min(AXIS.state_set.margin(found.state(np.arange(61)))) >= 0
    assert found.window(50, 10).states.shape == (11, 2)
    with pytest.raises(ValueError, match=r"^step 61 \(3.05 s\) is outside of what is proved, all real t from 0"):
        found.window(51, 10)


def test_two_periodic_signals_swing_about_their_means_with_one_period():
    t = np.linspace(0, 4, 20)
    a, b = 0.5 + np.sin(2 * np.pi * t / 1.7), 0.5 * np.cos(2 * np.pi * t / 1.7)
    samples = {"a": Samples(t, a), "b": Samples(t + 0.03, b)}
    found = learn_reference(samples, CART, Periodic(), "all_phases", noise_std=0.05)
    assert found.prior.parts[0].mean == pytest.approx(0.5, abs=0.3)
    assert found.hyperparameters["period"] == pytest.approx(1.7, abs=0.05)
    assert "proved for all real t:" in found.explanation
    k = np.arange(5000)
    assert np.min(CART.input_set.margin(found.input(k))) >= 0


def test_known_and_bounded_hyperparameters_stay_and_those_at_an_end_of_their_interval_are_asked_about():
    """The likelihood wants a length scale near 0.9 s, and more noise."""
    kernel = SquaredExponential(signal_std=0.4, lengthscale=(1.2, 4.0))
    with pytest.warns(DoubtfulInputWarning) as caught:
        found = learn_reference(SAMPLES, AXIS, kernel, (0.0, 3.0), noise_std=(0.01, 0.015), starts=2)
    lengthscale, noise_std = (str(question.message) for question in caught)
    assert lengthscale.startswith("lengthscale = 1.2 lies at the lower end of the interval in which it was sought")
    assert noise_std.startswith("noise_std = 0.015 lies at the upper end of the interval in which it was sought")
    assert found.hyperparameters == pytest.approx({"signal_std": 0.4, "lengthscale": 1.2, "noise_std": 0.015}, rel=1e-3)
