"""Samples of several states that show one flat output are learned from together."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from pipeline.loops.interpolated import InterpolatedReference
from pipeline.loops.online import receding_window
from tests.trackably.plants import AXIS, SAMPLES, TIMES
from trackably import (
    ConstrainedSystem,
    Periodic,
    Polytope,
    Proved,
    Samples,
    SquaredExponential,
    TrackableReference,
    check,
    learn_reference,
    mobile_robot,
)
from trackably.gp.joint import JointPosterior
from trackably.gp.stencil import Stencils
from trackably.systems.sampling import kinds_by_name, sampled_signals, stencils_by_name

SPEED = np.where(TIMES < 1.5, 0.5 * np.pi / 1.5 * np.sin(np.pi * TIMES / 1.5), 0.0)
FEW = Samples(SAMPLES.times[::5], SAMPLES.values[::5])
VELOCITY = Samples(TIMES, SPEED + 0.05 * np.random.default_rng(1).standard_normal(TIMES.size))
KERNEL = SquaredExponential(0.7, 0.8)
STDS = {"position": 0.02, "velocity": 0.05}


def learned(given: dict[str, Samples], noise_std: object = STDS, **options: object) -> TrackableReference:
    return learn_reference(given, AXIS, KERNEL, "all_times", noise_std=noise_std, starts=1, **options)


@pytest.fixture(scope="module")
def both() -> TrackableReference:
    return learned({"velocity": VELOCITY, "position": FEW})


def velocity_error(found: TrackableReference) -> float:
    steps = np.arange(60)
    clean = np.where(steps * 0.05 < 1.5, 0.5 * np.pi / 1.5 * np.sin(np.pi * steps * 0.05 / 1.5), 0.0)
    return float(np.sqrt(np.mean((found.state(steps)[:, 1] - clean) ** 2)))


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


def test_it_is_proved_saved_and_read_again(both, tmp_path: Path) -> None:
    both.save_certificate(tmp_path / "proof.json")
    assert isinstance(check(tmp_path / "proof.json"), Proved)
    both.save(tmp_path / "r.json")
    again = TrackableReference.load(tmp_path / "r.json")
    np.testing.assert_array_equal(again.state(np.arange(50)), both.state(np.arange(50)))
    assert again.misfit == both.misfit
    assert isinstance(again.samples[0].stencil, Stencils)


def test_samples_that_say_nothing_change_nothing() -> None:
    """Velocities with enormous noise: the likelihood gains a constant, the reference is the same."""
    alone, noisy = learned({"position": SAMPLES}, 0.02), learned(
        {"position": SAMPLES, "velocity": VELOCITY}, {"position": 0.02, "velocity": 1e7}
    )  # fmt: skip
    np.testing.assert_allclose(noisy.state(np.arange(80)), alone.state(np.arange(80)), atol=1e-6)


def test_hyperparameters_are_learned_from_all(both) -> None:
    found = learn_reference(
        {"position": FEW, "velocity": VELOCITY}, AXIS, SquaredExponential(), "all_times", noise_std=STDS, starts=2
    )
    assert found.objective < both.objective
    least = JointPosterior(found.prior, found.samples).negative_log_marginal_likelihood()[0]
    assert least <= found.objective


def test_one_noise_stands_for_all_where_samples_have_their_own() -> None:
    """As recordings give them: σ_n = 1, and the deviation of each sample."""
    given = {
        name: Samples(of.times, of.values, np.full(len(of), STDS[name]))
        for name, of in (("position", FEW), ("velocity", VELOCITY))
    }
    one, other = learned(given, 1.0), learned({"position": FEW, "velocity": VELOCITY})
    np.testing.assert_allclose(one.state(np.arange(60)), other.state(np.arange(60)), atol=1e-8)


def test_names_are_in_order_and_samples_sorted() -> None:
    (kinds,) = kinds_by_name(AXIS, ["velocity", "position"])
    assert [*kinds] == ["position", "velocity"]
    names, (samples,) = sampled_signals(AXIS, {"velocity": VELOCITY, "position": FEW})
    assert names == ("position",)
    assert isinstance(samples.stencil, Stencils)
    assert samples.stencil.names == ("position", "velocity")
    assert all(a <= b for a, b in pairwise(samples.times))
    np.testing.assert_array_equal(samples.by_name("")["velocity"].values, VELOCITY.values)
    with pytest.raises(ValueError, match="velocity and position show the same flat output; give one of them"):
        stencils_by_name(AXIS, ["position", "velocity"])
    with pytest.raises(ValueError, match="velocity says how its flat output moves, but not where it is"):
        kinds_by_name(AXIS, ["velocity"])


def test_straight_lines_connect_those_that_show_the_level() -> None:
    _, (samples,) = sampled_signals(AXIS, {"velocity": VELOCITY, "position": FEW})
    _, (alone,) = sampled_signals(AXIS, {"position": FEW})
    lines = [InterpolatedReference((of,), AXIS).window(0, 50).states for of in (samples, alone)]
    np.testing.assert_array_equal(*lines)


def test_the_last_samples_keep_their_kinds() -> None:
    _, together = sampled_signals(AXIS, {"velocity": VELOCITY, "position": FEW})
    (last,) = receding_window(together, 3.0, 4)
    kinds = last.by_name("")
    assert {name: len(of) for name, of in kinds.items()} == {"position": 1, "velocity": 3}
    assert kinds["velocity"].values.tolist() == VELOCITY.values[-3:].tolist()
    (one,) = receding_window(together, 3.0, 1)
    assert not isinstance(one.stencil, Stencils)


def test_a_robot_learns_from_positions_and_velocities() -> None:
    step, period, std = 0.1, 12.0, 0.03
    rng, phase = np.random.default_rng(0), 2 * np.pi / period
    paths = {"x": lambda t: 1.5 * np.sin(phase * t), "y": lambda t: 0.8 * np.sin(2 * phase * t)}
    plant = ConstrainedSystem(
        mobile_robot(step),
        Polytope.box([-3.0, -3.0, -np.inf], [3.0, 3.0, np.inf]),
        Polytope.box([0.1, -2.5], [1.6, 2.5]),
    )
    few, many, steps = np.arange(0.0, period, 1.5), np.arange(0.0, period, 0.5), np.arange(120.0)
    given = {name: Samples(few, path(few) + std * rng.standard_normal(few.size)) for name, path in paths.items()}
    rates = {name: (path(many + step) - path(many)) / step for name, path in paths.items()}
    both = given | {
        f"rate of {name}": Samples(many, rate + std * rng.standard_normal(many.size)) for name, rate in rates.items()
    }
    kernel = Periodic(1.0, 1.0, period)

    def error(samples: dict[str, Samples]) -> float:
        noise = dict.fromkeys(samples, std)
        found = learn_reference(samples, plant, kernel, "all_phases", noise_std=noise, starts=1)
        assert [*found.misfit] == [name for path in paths for name in samples if name.endswith(path)]
        true = np.diff([path(steps * step) for path in paths.values()])
        return float(np.sqrt(np.mean((np.diff(found.state(steps)[:, :2], axis=0).T - true) ** 2)))

    assert error(both) < 0.8 * error(given)
