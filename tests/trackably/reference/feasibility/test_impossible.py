"""What no reference can satisfy is told before one is sought; what some trajectory satisfies is never called so."""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.attack.liars import OF_CONTRADICTIONS
from tests.trackably.certificates.liars import plant as put_lie
from tests.trackably.plants import AXIS, KERNEL, SAMPLES
from tests.trackably.reference.feasibility import naive
from tests.trackably.reference.feasibility.instances import random_plant, trajectory
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
    tank,
)
from trackably.certificates.claim import Written, as_claim
from trackably.certificates.judge import accepted_file
from trackably.checker.contradiction import Value
from trackably.reference import learn as learning
from trackably.reference.feasibility import Steps, impossible, least
from trackably.reference.waypoints import Waypoints, waypoints
from trackably.streams import learn as streams
from trackably.systems.tightening import tightening

WEAK = replace(AXIS, state_set=Polytope.box([-1, -1.5], [1, 1.5]), input_set=Polytope.box([-0.1], [0.1]))
MOVING = replace(AXIS, state_set=Polytope.box([0.3, 0.5], [1.0, 1.5]))
REST = {"position": 0.0, "velocity": 0.0}
SEEDS = range(12)


def told(at: Waypoints, plant: ConstrainedSystem = WEAK, claim: Written = "all_times", mean: float = 0.0) -> Any:
    claim = as_claim(claim)
    return impossible(plant, claim, waypoints(at, 1e-6, plant, claim), [mean] * plant.signal_count)


def random_steps(rng: np.random.Generator) -> Steps:
    """Some values that lie inside their bounds, each at a step of its own."""
    plant = random_plant(rng)
    names = rng.choice(plant.system.states, size=4)
    extents = {name: plant.state_set.extent(i) for i, name in enumerate(plant.system.states)}
    middles = [rng.uniform(extents[name].lower, extents[name].upper) for name in names]
    at = sorted(rng.choice(12, size=4, replace=False).tolist())
    values = tuple(
        Value(k, str(name), middle, middle + 1e-6 * extents[name].width)
        for k, name, middle in zip(at, names, middles, strict=True)
    )
    return Steps(plant, 0.0, 15, values)


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


@pytest.mark.parametrize("claim", ["all_times", "all_phases", (-3.0, 9.0)])
def test_who_cannot_brake_in_time_is_told(claim):
    """v² / 2 u is left of the way, less what the last step of constant force overshoots."""
    found = told({0.0: {"position": 0.9, "velocity": 1.0}}, claim=claim)
    assert found.given == "velocity = 1 at t = 0 s"
    assert found.missing == pytest.approx(1.0 - np.sqrt(2 * 0.1 * 0.1), abs=5e-3)
    assert any(said.startswith("force (lower bound -0.1) from t = 0 s to") for said in found.among)
    assert told({0.0: {"position": 0.9, "velocity": 0.99 * np.sqrt(2 * 0.1 * 0.1)}}, claim=claim) is None


@pytest.mark.parametrize("start", [0.0, -100.0, -0.04, 1e9])
def test_bounds_alone_are_told_with_the_part_that_is_missing_wherever_the_window_is(start):
    """At least 0.5 m/s for 3 s on 0.7 m: (0.5 - d) 3 = 0.7 (1 + 2 d)."""
    found = told({}, MOVING, (start, start + 3.0))
    assert found.given == ""
    assert found.missing == pytest.approx((1.5 - 0.7) / (3 + 1.4), abs=1e-6)
    assert "each of these would have to be moved by 0.181 of its width at least" in found.explanation
    assert any(said.startswith("velocity (lower bound 0.5) from t =") for said in found.among)
    assert told({}, MOVING, (start, start + 1.3)) is None


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


@pytest.mark.parametrize("seed", SEEDS)
def test_what_a_trajectory_does_is_never_called_impossible(seed, monkeypatch):
    """Only tightened bounds exclude it, and only in their own words; no multipliers do, whatever proposes them."""
    rng = np.random.default_rng(seed)
    plant, claim, at = trajectory(rng)
    given = claim, waypoints(at, 1e-9, plant, claim), [0.0] * plant.signal_count
    assert impossible(plant, *given) is None
    drawn = tightening(plant, margin=float(rng.uniform(0.05, 0.45)))
    found = impossible(drawn.plant, *given, drawn)
    assert found is None or isinstance(found, InfeasibleTightening)
    put_lie("multipliers are any numbers", seed, monkeypatch.setattr, OF_CONTRADICTIONS)
    assert impossible(plant, *given) is None


@pytest.mark.parametrize("seed", SEEDS)
def test_what_is_missing_is_what_another_program_finds(seed):
    steps = random_steps(np.random.default_rng(seed))
    elastic = np.where(steps.is_given, steps.widths, 0.0)
    found = least(steps, elastic)
    assert found is not None
    expected = naive.missing(steps, elastic)
    assert found.missing == pytest.approx(expected, rel=1e-5, abs=1e-6)


FREE = replace(WEAK, state_set=Polytope.box([-1, -np.inf], [1, np.inf]))


@pytest.mark.parametrize("first", [0.0, 0.35])
def test_a_free_state_is_bounded_by_what_the_others_do(first):
    """The velocity is free, and no value of it is given: positions and forces of two steps say what it is at most."""
    assert told({first: REST, first + 1.0: {"position": 0.8}}, FREE).missing == pytest.approx(0.75, abs=1e-5)
    found = told({first: {"position": 0.1}, first + 0.1: {"position": 0.5}, first + 0.2: {"position": -0.5}}, FREE)
    assert found.given == f"position = 0.5 at t = {first + 0.1:g} s"


DRAINED = ConstrainedSystem(tank(5.0), Polytope.box([0.1], [2.0]), Polytope.box([0.0], [0.05]))
OUT_OF_REACH = {"noise_std": 0.02, "at": {0.0: REST, 1.0: {"position": 0.8}}}
LEARNERS = {
    "a reference": lambda: learn_reference(SAMPLES, WEAK, KERNEL, "all_times", **OUT_OF_REACH),
    "a stream": lambda: streams.learn_stream(SAMPLES, WEAK, KERNEL, "all_times", window=2.0, **OUT_OF_REACH),
    "a nonlinear system": lambda: learn_reference(
        Samples([0.0, 270.0], [1.2, 0.4]), DRAINED, SquaredExponential(), (0.0, 270.0), mean=1.0
    ),
}


@pytest.mark.parametrize("learner", LEARNERS)
def test_nothing_is_learned_where_nothing_is_possible(learner, monkeypatch):
    monkeypatch.setattr(learning, "learn_certified", None)
    monkeypatch.setattr(streams, "learn_proved", None)
    with pytest.raises(NotTrackableError, match=r"no reference exists.* is out of reach by at least") as raised:
        LEARNERS[learner]()
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
    times = np.arange(0, 2.4, 0.1)
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
    assert content["missing"] == error.outcome.missing
    with pytest.raises(ValueError, match="save_counterexample: there is none"):
        error.save_counterexample(tmp_path / "none.json")
    more = NotTrackableError(replace(error.outcome, contradiction={**content, "missing": 2 * content["missing"]}))
    assert more.outcome.explanation.startswith("it is not shown that no reference exists")
