"""Values at given times: met up to a tolerance that is proved, or refused."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from tests.trackably.checker.redundant import PLANT as REDUNDANT
from tests.trackably.plants import AXIS, CART, SAMPLES
from trackably import (
    ConstrainedSystem,
    Failed,
    NonlinearSystem,
    NotTrackableError,
    Polytope,
    Proved,
    Samples,
    SquaredExponential,
    TrackableReference,
    check,
    learn_reference,
    mobile_robot,
)
from trackably.certificates.outcome import Counterexample
from trackably.learning.joint.search import learn_jointly
from trackably.reference import learn as learning

KNOWN = SquaredExponential(0.5, 0.6)
AT = {1.0: {"force": -1.0}, 0.0: {"position": -0.98, "velocity": 0.0}}
TANK = ConstrainedSystem(
    NonlinearSystem.of(lambda x, u: [x[0] + 0.1 * u[0] - 0.05 * x[0] ** 2], ["level"], ["inflow"], 0.1),
    Polytope.box([0.1], [2.0]),
    Polytope.box([-2.0], [4.0]),
)
FREE = ConstrainedSystem(AXIS.system, Polytope.box([-np.inf, -1.0], [np.inf, 1.0]), AXIS.input_set)
SLOPING = ConstrainedSystem(CART.system, Polytope([[1.0, 1.0], [1.0, -1.0]], [-1.0, -1.0], [1.0, 1.0]), CART.input_set)


def learned(at, plant=AXIS, kernel=KNOWN, **options):
    return learn_reference({"position": SAMPLES}, plant, kernel, "all_times", noise_std=0.02, at=at, **options)


@pytest.fixture(scope="module")
def axis():
    return learned(AT)


def test_values_are_met_within_a_ten_thousandth_of_their_bounds(axis):
    assert np.all(np.abs(axis.state(0) - [-0.98, 0.0]) <= [1.3e-4, 2e-4])
    np.testing.assert_allclose(axis.input(20), [-1.0], atol=5e-4, rtol=0)
    assert "position = -0.98 ± 0.00013, velocity = 0 ± 0.0002 at 0 s; force = -1 ± 0.0005 at 1 s" in axis.explanation
    assert np.min(AXIS.state_set.margin(axis.state(np.arange(999)))) >= 0


def test_a_certificate_for_each_time_proves_it(axis, tmp_path):
    files = axis.save_certificate(tmp_path / "proof.json")
    assert [file.name for file in files] == ["proof.json", "proof.at1.json", "proof.at2.json"]
    verdicts = [check(file) for file in files[1:]]
    assert all(isinstance(verdict, Proved) for verdict in verdicts)
    assert (
        'For all real t from -5e-08 s to 5e-08 s the reference keeps -0.98013 ≤ "position" ≤ -0.97987'
        in verdicts[0].statement
    )
    content = json.loads(files[2].read_text())
    content["reference"]["plant"]["input_set"]["lower"] = [-0.9999]
    assert isinstance(check(content), Failed)


def test_what_is_saved_is_proved_again_at_each_time(axis, tmp_path):
    axis.save(tmp_path / "axis.json")
    again = TrackableReference.load(tmp_path / "axis.json")
    assert again.explanation == axis.explanation
    assert len(again.pin_certificates) == 2
    content = json.loads((tmp_path / "axis.json").read_text())
    content["fit"]["pinned"][0]["values"]["position"] += 0.001
    (tmp_path / "axis.json").write_text(json.dumps(content))
    with pytest.raises(NotTrackableError, match=r"at t = .* s the position certainly breaks"):
        TrackableReference.load(tmp_path / "axis.json")


def test_values_that_are_not_met_are_no_reference(monkeypatch):
    """A planted fault: a learner that forgets them."""

    def forgetful(problem, **known):
        return learn_jointly(replace(problem, required=()), **known)

    monkeypatch.setattr(learning, "learn_jointly", forgetful)
    with pytest.raises(NotTrackableError, match="the position certainly breaks") as raised:
        learned({0.0: {"position": -0.5}})
    assert isinstance(raised.value.outcome, Counterexample)


def curve(low, high):
    """From one level to another in 3 s, with noise."""
    t = np.arange(0.0, 3.01, 0.15)
    part = np.clip(t / 3.0, 0.0, 1.0)
    noise = 0.003 * np.random.default_rng(0).normal(size=len(t))
    return Samples(t, low + (high - low) * (10 * part**3 - 15 * part**4 + 6 * part**5) + noise)


RESTING = {
    "a tank": (TANK, {"level": curve(0.6, 1.5)}),
    "two outputs": (CART, {"a": curve(-0.3, 0.2), "b": curve(0.1, -0.4)}),
}


@pytest.mark.parametrize("name", RESTING)
def test_at_rest_the_system_stays_where_it_is_with_the_input_that_holds_it(name, tmp_path):
    plant, samples = RESTING[name]
    at = {0.0: "rest", 3.0: "rest"}
    found = learn_reference(samples, plant, SquaredExponential(1.0, 1.0), (0.0, 3.0), noise_std=0.02, at=at)
    assert [pinned.time for pinned in found.fit.pinned] == list(at)
    for pinned in found.fit.pinned:
        k = round(pinned.time / plant.sampling_time)
        x, u = (np.array([pinned.values[of] for of in names]) for names in (plant.system.states, plant.system.inputs))
        np.testing.assert_allclose(plant.system.successor(x, u), x, rtol=0, atol=1e-12)
        tolerances = np.array([pinned.tolerances[of] for of in plant.system.states])
        for step in (k, k + 1):
            assert np.all(np.abs(found.reference.state(step) - x) <= tolerances)
    files = found.save_certificate(tmp_path / "proof.json")
    assert all(isinstance(check(file), Proved) for file in files)
    found.save(tmp_path / "reference.json")
    assert TrackableReference.load(tmp_path / "reference.json").explanation == found.explanation


ROBOT = ConstrainedSystem(
    mobile_robot(0.1), Polytope.box([-3, -3, -np.inf], [3, 3, np.inf]), Polytope.box([0.1, -2], [1.5, 2])
)


REST = {"claim": (0.0, 2.0), "at": {1.0: "rest"}}
REFUSALS = {
    "rest of a robot": (
        {**REST, "plant": ROBOT, "samples": {"x": SAMPLES, "y": SAMPLES}},
        "at: rest at 1 s cannot be asked for, as the heading is not defined whi",
    ),
    "rest of redundant inputs": (
        {**REST, "plant": REDUNDANT},
        "at 1 s cannot be asked for, as several inputs act alike",
    ),
    "rest without bounds": ({**REST, "plant": FREE}, "at_tolerance: is needed for position, which has no bounds"),
    "one of several inputs": (
        {"plant": REDUNDANT, "at": {0.0: {"u1": 0.0}}},
        "at: u1 is one of several inputs that act alike; only their effect is",
    ),
    "alone": ({"method": "hyperparameters"}, 'at: values at given times need method="joint"'),
    "unknown": ({"at": {0.0: {"speed": 1.0}}}, "at: speed is neither a state nor an input (position, velocity, force)"),
    "too early": (
        {"at": {-0.1: {"position": 0.0}}},
        "at: -0.1 s is outside of the times that are claimed, from 0 s to",
    ),
    "outside": ({"at": {0.0: {"velocity": 1.5}}}, "at: velocity must be inside [-1, 1] at 0 s, got 1.5"),
    "together outside": (
        {"plant": SLOPING, "samples": {"a": SAMPLES, "b": SAMPLES}, "at": {0.0: {"a": 0.9, "b": 0.9}}},
        "at: a = 0.9 ± 0.0002, b = 0.9 ± 0.0002 at 0 s lies outside of {x : -1 ≤ x1 + x2 ≤ 1",
    ),
}


@pytest.mark.parametrize("name", REFUSALS)
def test_refusals_say_what_is_wrong(name):
    changed, sentence = REFUSALS[name]
    given = {"samples": SAMPLES, "plant": AXIS, "kernel": KNOWN, "claim": "all_times", "at": {0.0: {"position": 0.0}}}
    with pytest.raises(ValueError, match=re.escape(sentence)):
        learn_reference(**given | changed, noise_std=0.02)
