"""What no reference can satisfy is told before one is sought; what some trajectory satisfies is never called so."""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.attack.liars import attack
from tests.trackably.checker.test_contradiction import relaxed
from tests.trackably.feasibility.instances import random_plant, trajectory
from tests.trackably.plants import AXIS, KERNEL, SAMPLES
from trackably import (
    ConstrainedSystem,
    Impossible,
    InfeasibleTightening,
    LinearSystem,
    NotTrackableError,
    PolynomialPieces,
    Polytope,
    Samples,
    SquaredExponential,
    TrackableReference,
    Zonotope,
    check,
    checker,
    learn_reference,
)
from trackably import learn as learning
from trackably.certificates.claim import Written, as_claim
from trackably.certificates.judge import accepted_file
from trackably.checker.certificate import Window
from trackably.feasibility import impossible
from trackably.streams import learn as streams
from trackably.systems.tightening import tightening
from trackably.waypoints import Waypoints, waypoints

WEAK = replace(AXIS, state_set=Polytope.box([-1, -1.5], [1, 1.5]), input_set=Polytope.box([-0.1], [0.1]))
MOVING = replace(AXIS, state_set=Polytope.box([0.3, 0.5], [1.0, 1.5]))
REST = {"position": 0.0, "velocity": 0.0}
SEEDS = range(8)


def told(at: Waypoints, plant: ConstrainedSystem = WEAK, claim: Written = "all_times", mean: float = 0.0) -> Any:
    claim = as_claim(claim)
    return impossible(plant, claim, waypoints(at, 1e-6, plant, claim), [mean] * plant.signal_count)


def test_how_much_is_missing_is_what_the_largest_force_leaves():
    found = told({0.0: REST, 1.0: {"position": 0.8}})
    assert found.given == "position = 0.8 at t = 1 s"
    assert found.missing == pytest.approx(0.8 - 0.1 / 2, abs=1e-5)
    assert found.missing < 0.8 - 0.1 / 2
    assert found.explanation == (
        "no reference exists, whatever the kernel and the samples: position = 0.8 at t = 1 s is out of reach by at "
        "least 0.749, because of position = 0 at t = 0 s; velocity = 0 at t = 0 s; force (upper bound 0.1) from "
        "t = 0 s to 0.95 s"
    )


@pytest.mark.parametrize("claim", ["all_times", "all_phases", (0.0, 9.0), (-3.0, 9.0)])
def test_who_cannot_brake_in_time_is_told(claim):
    """v² / 2 u is left of the way, less what the last step of constant force overshoots."""
    found = told({0.0: {"position": 0.9, "velocity": 1.0}}, claim=claim)
    assert found.given == "velocity = 1 at t = 0 s"
    assert found.missing == pytest.approx(1.0 - np.sqrt(2 * 0.1 * 0.1), abs=5e-3)
    assert any(said.startswith("force (lower bound -0.1) from t = 0 s to") for said in found.among)
    assert told({0.0: {"position": 0.9, "velocity": 0.99 * np.sqrt(2 * 0.1 * 0.1)}}, claim=claim) is None


def test_bounds_alone_are_told_with_the_part_that_is_missing():
    """At least 0.5 m/s for 3 s on 0.7 m: (0.5 - d) 3 = 0.7 (1 + 2 d)."""
    found = told({}, MOVING, (0.0, 3.0))
    assert found.given == ""
    assert found.missing == pytest.approx((1.5 - 0.7) / (3 + 1.4), abs=1e-6)
    assert "velocity (lower bound 0.5) from t = 0 s to 3 s" in found.among
    assert "each of these would have to be moved by 0.181 of its width at least" in found.explanation
    assert told({}, MOVING, (0.0, 1.3)) is None


@pytest.mark.parametrize("start", [-3.0, -0.04, 1e9])
def test_windows_are_examined_wherever_they_are(start):
    found = told({}, MOVING, (start, start + 3.0))
    assert found.missing == pytest.approx((1.5 - 0.7) / (3 + 1.4), abs=1e-6)
    assert told({}, MOVING, (start, start + 0.02)) is None


@pytest.mark.parametrize(
    ("low", "high", "impossibly"),
    [
        (-1.0, PolynomialPieces.steps({0.0: 1.0, 2.0: 0.5}), False),
        (PolynomialPieces.lines({1.0: -1.0, 1.5: 0.6}), PolynomialPieces.lines({1.0: -0.5, 1.4: 1.0}), True),
        (PolynomialPieces.lines({1.0: -1.0, 3.5: 0.6}), PolynomialPieces.lines({1.0: -0.5, 3.4: 1.0}), False),
        (
            PolynomialPieces.lines({1.0: -1.0, 1.25: 0.6}, 2.5),
            PolynomialPieces.lines({1.0: -0.5, 1.24: 1.0}, 2.5),
            True,
        ),
    ],
)
def test_bounds_that_move_faster_than_the_plant_are_proved_impossible(low, high, impossibly):
    plant = replace(AXIS, state_set=Polytope.box([low, -9], [high, 9]), input_set=Polytope.box([-1.0], [1.0]))
    found = told({}, plant, (0.0, 4.0))
    assert (found is not None) is impossibly
    if found:
        assert "position (lower bound" in found.explanation
        assert isinstance(checker.check(found.contradiction), checker.Contradicted)
        assert isinstance(checker.check({**found.contradiction, "missing": 1.1 * found.missing}), checker.Failed)


def test_times_that_steps_do_not_link_exclude_nothing():
    assert told({0.0: {"position": 0.0}, 0.025: {"position": 0.9}}) is None
    assert told({0.0: {"position": 0.0}, 0.05: {"position": 0.9}}) is not None
    assert told({0.3: {"position": 0.0}, 0.35: {"position": 0.9}}) is not None


FREE = replace(WEAK, state_set=Polytope.box([-1, -np.inf], [1, np.inf]))


@pytest.mark.parametrize("first", [0.0, 0.35])
def test_a_free_state_is_bounded_by_what_the_others_do(first):
    """The velocity is free, and no value of it is given: positions and forces of two steps say what it is at most."""
    assert told({first: REST, first + 1.0: {"position": 0.8}}, FREE).missing == pytest.approx(0.75, abs=1e-5)
    found = told({first: {"position": 0.1}, first + 0.1: {"position": 0.5}, first + 0.2: {"position": -0.5}}, FREE)
    assert found.given == f"position = 0.5 at t = {first + 0.1:g} s"


@pytest.mark.parametrize("learn", [learning.learn_reference, streams.learn_stream])
def test_nothing_is_learned_where_nothing_is_possible(learn, monkeypatch):
    monkeypatch.setattr(learning, "learn_certified", None)
    monkeypatch.setattr(streams, "learn_proved", None)
    options = {"window": 2.0} if learn is streams.learn_stream else {}
    with pytest.raises(NotTrackableError, match="no reference exists") as raised:
        learn(SAMPLES, WEAK, KERNEL, "all_times", noise_std=0.02, at={0.0: REST, 1.0: {"position": 0.8}}, **options)
    assert isinstance(raised.value.outcome, Impossible)


FIRST = ConstrainedSystem(
    LinearSystem([[0.9]], [[1.0]], states=("x",), sampling_time=0.1), Polytope.box([-10], [10]), Polytope.box([-1], [1])
)
JUMP = {1.0: {"x": -0.460756}, 1.1: {"x": 0.506832}}  # by the input 0.921512
FAR = {1.0: {"x": -0.460756}, 1.1: {"x": 0.8}}  # by the input 1.214680
PUSHED = Zonotope.box([-0.1], [0.1])
DRAWN_IN = {
    "the feedback that is chosen": ({"disturbance": PUSHED}, "under the feedback K = [[-0.89", "another feedback="),
    "a margin": ({"margin": 0.05}, "by the margin 0.05 of each width", "a smaller margin="),
    "both": (
        {"disturbance": PUSHED, "margin": 0.01},
        "and by the margin 0.01 of each width",
        "another feedback= or a smaller margin=",
    ),
}


def learned_first(at: Waypoints, **options: Any) -> TrackableReference:
    times = np.arange(0, 3, 0.1)
    samples = Samples(times, 0.3 * np.sin(2 * times))
    return learn_reference(samples, FIRST, SquaredExponential(), "all_times", noise_std=0.05, at=at, **options)


@pytest.mark.parametrize("name", DRAWN_IN)
def test_what_a_feedback_or_a_margin_excludes_is_not_called_impossible(name):
    options, tightened, instead = DRAWN_IN[name]
    with pytest.raises(NotTrackableError) as raised:
        learned_first(JUMP, **options)
    outcome = raised.value.outcome
    assert isinstance(outcome, InfeasibleTightening)
    assert not isinstance(outcome, Impossible)
    assert outcome.explanation.startswith("no reference keeps the bounds tightened ")
    assert "no reference exists" not in outcome.explanation
    assert tightened in outcome.explanation
    assert f"; {instead} may leave more room: x = 0.506832 at t = 1.1 s is out of reach" in outcome.explanation


@pytest.mark.filterwarnings("ignore::trackably.IgnoresSamplesWarning")
def test_another_feedback_proves_what_the_chosen_one_excludes():
    found = learned_first(JUMP, disturbance=PUSHED, feedback=[[-0.2]])
    assert found.reference.state_at(np.array([1.0, 1.1])).ravel() == pytest.approx([-0.460756, 0.506832], abs=2e-3)


@pytest.mark.parametrize("name", DRAWN_IN)
def test_what_the_own_bounds_exclude_is_impossible_for_every_feedback_and_margin(name):
    found = []
    for options in ({}, DRAWN_IN[name][0]):
        with pytest.raises(NotTrackableError) as raised:
            learned_first(FAR, at_tolerance=1e-3, **options)
        found.append(raised.value.outcome)
    assert isinstance(found[0], Impossible)
    assert found[0] == found[1]


@pytest.mark.parametrize("seed", SEEDS)
def test_no_margin_makes_an_admissible_trajectory_impossible(seed):
    """Only tightened bounds exclude it, and only in their own words."""
    rng = np.random.default_rng(seed)
    plant = random_plant(rng)
    states = trajectory(plant, rng, 30)
    at = {0.1 * k: dict(zip(plant.system.states, states[k].tolist(), strict=True)) for k in range(0, len(states), 3)}
    drawn, claim = tightening(plant, margin=float(rng.uniform(0.05, 0.45))), Window(0.0, 0.1 * max(1, len(states) - 1))
    pinned = waypoints(at, 1e-9, plant, claim)
    found = impossible(drawn.plant, claim, pinned, [0.0] * plant.signal_count, drawn)
    assert found is None or isinstance(found, InfeasibleTightening)


@pytest.mark.parametrize(
    ("plant", "at", "claim"),
    [
        (WEAK, {0.0: REST, 1.0: {"position": 0.8}}, "all_times"),
        (FREE, {0.35: REST, 1.35: {"position": 0.8}}, "all_times"),
        (MOVING, {}, (0.0, 3.0)),
    ],
    ids=["values", "a free state", "bounds"],
)
def test_what_is_told_is_what_the_checker_accepted_and_a_file_of_it(plant, at, claim, tmp_path):
    error = NotTrackableError(told(at, plant, claim))
    error.save_contradiction(file := tmp_path / "impossible.json")
    assert isinstance(check(file), checker.Contradicted)
    assert file.read_bytes() == accepted_file(error.outcome)
    content = json.loads(file.read_bytes())
    assert content["missing"] == error.outcome.missing == pytest.approx(relaxed(content)[0], rel=1e-5)
    with pytest.raises(ValueError, match="save_counterexample: there is none"):
        error.save_counterexample(tmp_path / "none.json")
    more = NotTrackableError(replace(error.outcome, contradiction={**content, "missing": 2 * content["missing"]}))
    assert more.outcome.explanation.startswith("it is not shown that no reference exists")


@pytest.mark.parametrize("lies", [False, True])
@pytest.mark.parametrize("seed", SEEDS)
def test_what_a_trajectory_does_is_never_called_impossible(seed, lies):
    """Neither is it where what proposes lies: multipliers of any size, for more than is missing."""
    for what, why in attack("contradictions", seed, lies=lies):
        assert why is None, what
