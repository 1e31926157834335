"""A stream in one call: what `learn_reference` has too, and one certificate for the whole that the checker proves."""

import json
from functools import cache, partial

import numpy as np
import pytest

from tests.trackably.checker.changes import changed
from tests.trackably.plants import AXIS
from tests.trackably.saved import assert_comes_back
from trackably import (
    ConstrainedSystem,
    IgnoresSamplesWarning,
    InputError,
    Matern52,
    ModelError,
    NotTrackableError,
    Polytope,
    Proved,
    Samples,
    SquaredExponential,
    StreamReference,
    TrackableReference,
    Truth,
    Zonotope,
    check,
    learn_stream,
)
from trackably.certificates.form import encode_certificate
from trackably.codec import CodecError
from trackably.systems.library import tank

TIMES = np.arange(90) / 6
MOVED = -0.45 + 0.62 * np.sin(1.1 * TIMES + np.sin(0.4 * TIMES)) + 0.02 * np.random.default_rng(4).standard_normal(90)
PUSHED = Zonotope.box([-1e-3, -5e-3], [1e-3, 5e-3])
NOISE = Zonotope.box([-1e-3, -2e-3], [1e-3, 2e-3])
OPTIONS = {
    "all times": ({"claim": "all_times"}, "For all real t ≥ 0"),
    "margin": ({"margin": 0.05}, 'keeps -1.035 ≤ "position" ≤ 0.134999'),
    "pushed": ({"disturbance": PUSHED}, "every sequence of w in W"),
    "measured with noise": (
        {"disturbance": PUSHED, "measurement_noise": NOISE, "feedback": [[-15.0, -7.0]]},
        "every sequence of w in W and v in V",
    ),
    "wrong model": (
        {"model_error": ModelError.intervals(AXIS.system, {("velocity", "force"): (0.0495, 0.0505)})},
        "convex hull of A = ",
    ),
    "true signal": ({"truth": Truth(noise=0.08, slope=1.0)}, "The true signal: every f with"),
}
"""What is asked for beside a window, and what the checker then says."""
KNOWN = {"plant": AXIS, "kernel": SquaredExponential(0.6, 0.9), "window": 8.0, "noise_std": 0.02}
learn = partial(learn_stream, Samples(TIMES, MOVED), **KNOWN)


@cache
def learned(name: str) -> StreamReference:
    options, _ = OPTIONS[name]
    return learn(**{"claim": (0.0, 15.0), "mean": -0.45, "centres": None, **options})


@pytest.mark.parametrize("name", OPTIONS)
def test_the_checker_proves_what_is_saved_and_loaded(name, tmp_path):
    assert_comes_back(learned(name), tmp_path)
    verdict = check(tmp_path / "proof.json")
    assert isinstance(verdict, Proved)
    assert OPTIONS[name][1] in verdict.statement


def test_no_possible_signal_is_further_away_than_the_certificate_says():
    """The samples' own signal is one: they were drawn about it, within the bound of the noise."""
    reference, t = learned("true signal"), np.linspace(TIMES[0], TIMES[-1], 3001)
    true = -0.45 + 0.62 * np.sin(1.1 * t + np.sin(0.4 * t))
    assert np.max(np.abs(np.gradient(true, t))) < 1.0
    off = float(np.max(np.abs(reference(t)[:, 0] - true)))
    found = reference.accuracy("position")
    assert 0.02 < off <= found.error < 0.21
    assert found.radius <= found.error
    with pytest.raises(ValueError, match="has no true signal of velocity"):
        reference.accuracy("velocity")


def test_given_values_are_met_and_proved(tmp_path):
    """At the start, where windows meet, within one, and long after the last; each is a little beside the samples."""
    x, v, later = MOVED[0] + 0.03, 0.8, MOVED[48] - 0.03
    at = {0.0: {"position": x, "velocity": v}, 8.0: {"position": later}, 13.1: {"velocity": 0.2}}
    at[50.0] = {"position": -0.6}
    reference = learn(claim=(0.0, 51.0), mean=-0.45, centres=None, at=at, at_tolerance={"position": 1e-4})
    found = reference.reference.state_at(np.array([*at]))
    assert found[0] == pytest.approx([x, v], abs=1e-4)
    assert (found[1, 0], found[2, 1], found[3, 0]) == pytest.approx((later, 0.2, -0.6), abs=1e-4)
    assert_comes_back(reference, tmp_path)
    assert [type(check(file)) for file in reference.save_certificate(tmp_path / "stream.json")] == [Proved] * 5


def test_hyperparameters_and_a_mean_are_learned_from_one_window():
    asked = {"claim": (0.0, 15.0), "centres": None}
    found = learn(kernel=SquaredExponential(), noise_std=(0.005, 0.5), mean=(-1.0, 0.1), starts=2, **asked)
    (prior,) = found.prior.parts
    assert prior.noise_std == pytest.approx(0.02, rel=0.3)
    assert prior.mean == pytest.approx(-0.45, abs=0.15)
    assert found.misfit["position"] == pytest.approx(prior.noise_std, rel=0.3)
    again = learn(kernel=prior.kernel, noise_std=prior.noise_std, mean=prior.mean, **asked)
    assert again.fingerprint == found.fingerprint


def test_a_reference_that_bounds_keep_from_its_samples_is_announced():
    low = ConstrainedSystem(AXIS.system, Polytope.box([-0.9, -1.0], [-0.4, 1.0]), AXIS.input_set)
    with pytest.warns(
        IgnoresSamplesWarning, match=r"off those of position \(root mean square\); wider bounds may help"
    ):
        learn(plant=low, claim="all_times", mean=-0.45)


@pytest.mark.parametrize("window", [1.0, 0.02])
def test_a_window_of_a_few_samples_is_refused(window):
    with pytest.raises(ValueError, match=rf"^window: .* 8 samples .* got {window:g} s .* every 0\.167 s"):
        learn(window=window, claim="all_times")


def test_a_nonlinear_plant_is_followed_by_its_inputs():
    plant = ConstrainedSystem(
        tank(sampling_time=5.0, area=1.0, outflow=0.05), Polytope.box([0.7], [1.15]), Polytope.box([0.03], [0.065])
    )
    t = np.arange(0.0, 120.0, 4.0)
    level = 0.9 + 0.26 * np.sin(2 * np.pi * t / 120) + 0.01 * np.random.default_rng(3).standard_normal(t.size)
    found = learn_stream(
        Samples(t, level), plant, Matern52(0.2, 30.0), (0.0, 116.0), window=60.0, noise_std=0.03, mean=0.9
    )
    assert isinstance(check(encode_certificate(found.certificate)), Proved)
    steps = np.arange(23)
    x, u = found.state(steps), found.input(steps)
    np.testing.assert_allclose(plant.system.successor(x[:-1], u[:-1]), x[1:], atol=1e-9)
    assert 0 <= np.min(plant.state_set.margin(x)) < 0.005  # it touches a bound
    assert np.min(plant.input_set.margin(u)) >= 0


HARM = {
    "other bounds": ("tightening.margin", 0.01, CodecError, "other bounds than those of the saved reference"),
    "a reference that breaks its bounds": ("learned.signals.0.weights.50", 99.0, NotTrackableError, "position"),
}


@pytest.mark.parametrize(("path", "put", "error", "said"), HARM.values(), ids=HARM)
def test_files_that_were_changed_are_refused(path, put, error, said, tmp_path):
    learned("pushed").save(file := tmp_path / "stream.json")
    with pytest.raises(InputError, match=r"is a StreamReference, which StreamReference\.load reads"):
        TrackableReference.load(file)
    file.write_text(json.dumps(changed(json.loads(file.read_text()), path, put)))
    with pytest.raises(error, match=said):
        StreamReference.load(file)
