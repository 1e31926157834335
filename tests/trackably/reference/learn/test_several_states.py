"""Samples of several states that show one flat output are learned from together."""

import numpy as np
import pytest

from tests.trackably.plants import AXIS, SAMPLES, TIMES
from trackably import (
    Samples,
    SquaredExponential,
    TrackableReference,
    learn_reference,
)


def speed(t: np.ndarray) -> np.ndarray:
    return np.where(t < 1.5, 0.5 * np.pi / 1.5 * np.sin(np.pi * t / 1.5), 0.0)


FEW = Samples(SAMPLES.times[::5], SAMPLES.values[::5])
VELOCITY = Samples(TIMES, speed(TIMES) + 0.05 * np.random.default_rng(1).standard_normal(TIMES.size))
KERNEL = SquaredExponential(0.7, 0.8)
STDS = {"position": 0.02, "velocity": 0.05}


def learned(given: dict[str, Samples], noise_std: object = STDS, **options: object) -> TrackableReference:
    return learn_reference(given, AXIS, KERNEL, "all_times", noise_std=noise_std, starts=1, **options)


@pytest.fixture(scope="module")
def both() -> TrackableReference:
    return learned({"velocity": VELOCITY, "position": FEW})


def velocity_error(found: TrackableReference) -> float:
    steps = np.arange(60)
    return float(np.sqrt(np.mean((found.state(steps)[:, 1] - speed(steps * 0.05)) ** 2)))


def test_each_kind_has_its_own_misfit_in_its_own_unit(both) -> None:
    assert [*both.misfit] == ["position", "velocity"]
    for i, (samples, misfit) in enumerate(zip((FEW, VELOCITY), both.fit.misfits, strict=True)):
        off = samples.values - both.reference.state_at(samples.times)[:, i]
        assert both.misfit[misfit.name] == pytest.approx(np.sqrt(np.mean(off**2)), rel=1e-9)
        assert misfit.in_noise == pytest.approx(both.misfit[misfit.name] / STDS[misfit.name])
        assert f"off the samples of {misfit.name}" in both.explanation


def test_velocities_help(both) -> None:
    alone = learned({"position": FEW}, 0.02)
    assert velocity_error(both) < 0.7 * velocity_error(alone)


def test_one_noise_stands_for_all_where_samples_have_their_own(both) -> None:
    """As recordings give them: σ_n = 1, and the deviation of each sample."""
    one = learned(
        {
            name: Samples(of.times, of.values, np.full(len(of), STDS[name]))
            for name, of in (("position", FEW), ("velocity", VELOCITY))
        },
        1.0,
    )
    np.testing.assert_allclose(one.state(np.arange(60)), both.state(np.arange(60)), atol=1e-8)
