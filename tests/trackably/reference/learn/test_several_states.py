"""Samples of several states that show one flat output are learned from together."""

from pathlib import Path

import numpy as np
import pytest

from tests.trackably.plants import AXIS, SAMPLES, TIMES
from tests.trackably.saved import assert_comes_back
from trackably import (
    ConstrainedSystem,
    LinearSystem,
    Periodic,
    Polytope,
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
    for name, samples in (("position", FEW), ("velocity", VELOCITY)):
        at = both.reference.state_at(samples.times)[:, [*AXIS.system.states].index(name)]
        assert both.misfit[name] == pytest.approx(np.sqrt(np.mean((samples.values - at) ** 2)), rel=1e-9)
        assert f"off the samples of {name}" in both.explanation
    assert [round(misfit.in_noise, 6) for misfit in both.fit.misfits] == [
        round(both.misfit[name] / STDS[name], 6) for name in both.misfit
    ]


def test_velocities_help(both) -> None:
    alone = learned({"position": FEW}, 0.02)
    assert velocity_error(both) < 0.7 * velocity_error(alone)
    assert np.all(both.state_std(np.arange(60))[:, 1] < alone.state_std(np.arange(60))[:, 1])


def test_what_is_saved_comes_back(both, tmp_path: Path) -> None:
    assert_comes_back(both, tmp_path)


def test_one_noise_stands_for_all_where_samples_have_their_own() -> None:
    """As recordings give them: σ_n = 1, and the deviation of each sample."""
    given = {
        name: Samples(of.times, of.values, np.full(len(of), STDS[name]))
        for name, of in (("position", FEW), ("velocity", VELOCITY))
    }
    one, other = learned(given, 1.0), learned({"position": FEW, "velocity": VELOCITY})
    np.testing.assert_allclose(one.state(np.arange(60)), other.state(np.arange(60)), atol=1e-8)


def test_a_state_without_a_velocity_among_the_states_is_learned_from_its_rate_too() -> None:
    step, std, rng = 0.1, 0.03, np.random.default_rng(0)
    box = Polytope.box([-3.0], [3.0])
    plant = ConstrainedSystem(LinearSystem([[1.0]], [[step]], sampling_time=step, states=("x",)), box, box)
    few, many, steps = np.arange(0.0, 12.0, 1.5), np.arange(0.0, 12.0, 0.5), np.arange(120)

    def path(t):
        return 1.5 * np.sin(np.pi * t / 6) + 0.5 * np.sin(np.pi * t / 2)

    rates = (path(many + step) - path(many)) / step
    given = {"x": Samples(few, path(few) + std * rng.standard_normal(few.size))}
    both = given | {"rate of x": Samples(many, rates + std * rng.standard_normal(many.size))}

    def error(samples: dict[str, Samples]) -> float:
        noise = dict.fromkeys(samples, std)
        found = learn_reference(samples, plant, Periodic(1.0, 1.0, 12.0), "all_phases", noise_std=noise, starts=1)
        assert [*found.misfit] == [*samples]
        return float(np.sqrt(np.mean((np.diff(found.state(steps)[:, 0]) - np.diff(path(step * steps))) ** 2)))

    assert error(both) < 0.8 * error(given)
