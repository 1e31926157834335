"""What no reference can satisfy is told before one is sought; what some trajectory satisfies is never called so."""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest

from tests.attack.liars import OF_CONTRADICTIONS
from tests.trackably.certificates.liars import telling
from tests.trackably.plants import AXIS, KERNEL, SAMPLES
from tests.trackably.reference.feasibility.instances import random_plant, trajectory
from trackably import (
    ConstrainedSystem,
    Impossible,
    InfeasibleTightening,
    LinearSystem,
    NonlinearSystem,
    NotTrackableError,
    PolynomialPieces,
    Polytope,
    Samples,
    SquaredExponential,
    Zonotope,
    check,
    learn_reference,
    learn_stream,
    pendulum,
    tank,
    two_tanks,
)
from trackably.certificates.claim import Written, as_claim
from trackably.certificates.judge import accepted_file
from trackably.checker import Contradicted, Failed
from trackably.reference.feasibility import impossible
from trackably.reference.waypoints import Waypoints, waypoints
from trackably.systems.tightening import tightening

WEAK = replace(AXIS, state_set=Polytope.box([-1, -1.5], [1, 1.5]), input_set=Polytope.box([-0.1], [0.1]))
FREE = replace(WEAK, state_set=Polytope.box([-1, -np.inf], [1, np.inf]))
MOVING = replace(AXIS, state_set=Polytope.box([0.3, 0.5], [1.0, 1.5]))
REST = {"position": 0.0, "velocity": 0.0}
SEEDS = range(5)
CLAIMS: tuple[Written, ...] = "all_times", "all_phases", (-1.0, 3.0)


def between(low: Any, high: Any) -> ConstrainedSystem:
    """Return an axis with bounds of its position that move."""
    return replace(AXIS, state_set=Polytope.box([low, -9], [high, 9]), input_set=Polytope.box([-1.0], [1.0]))


def filled(inflow: float, low: float = 0.1) -> ConstrainedSystem:
    """Return a tank, whose level moves by 2.5 (inflow - 0.6 √level) in a step of 5 s."""
    return ConstrainedSystem(tank(5.0), Polytope.box([low], [2.0]), Polytope.box([0.0], [inflow]))


def added(lower: list[float], upper: list[float], states: Polytope, second: float = 1.0) -> ConstrainedSystem:
    """Return a system that adds an input to each of two states; the second is multiplied by the first, or not."""
    system = NonlinearSystem.of(
        lambda x, u: [x[0] + u[0], x[1] * (second + (1 - second) * x[0]) + u[1]], ("a", "b"), ("p", "q"), 1.0
    )
    return ConstrainedSystem(system, states, Polytope.box(lower, upper))


def told(plant: ConstrainedSystem, written: Written, at: Waypoints) -> Any:
    claim, level = as_claim(written), float(plant.system.states == ("level",))
    return impossible(plant, claim, waypoints(at, 1e-9, plant, claim), [level] * plant.signal_count)


LINES = PolynomialPieces.lines
FASTEST = np.sqrt(2 * 0.1 * 0.1)  # v² / 2 u is left of the way, less what the last step of constant force overshoots
FAST, SLOW = ({0.0: {"position": 0.9, "velocity": v}} for v in (1.0, 0.99 * FASTEST))
BRAKE = "velocity = 1 at t = 0 s", 1.0 - FASTEST, 5e-3, "force (lower bound -0.1) from t = 0 s to"
# At least 0.5 m/s for 3 s on 0.7 m: (0.5 - d) 3 = 0.7 (1 + 2 d).
TOO_SHORT = "", (1.5 - 0.7) / (3 + 1.4), 1e-6, "each of these would have to be moved by 0.181 of its width at least"
AFTER_A_STEP = 0.2 + 2.5 * (0.3 - 0.6 * np.sqrt(0.2))
LEAKS = Polytope([[1.0, 1e-10], [0.0, 1.0]], [-1.0, -1e12], [1.0, 1e12])  # a second state of 1e12 lets the first to 101
PRODUCT = added([0, 0], [0.1, 0.1], Polytope.box([-1.0, -np.inf], [1.0, np.inf]), 0.0)

TOLD: dict[str, tuple[ConstrainedSystem, Written, Waypoints, str, float, float, str]] = {
    "a value": (WEAK, "all_times", {0.0: REST, 1.0: {"position": 0.8}}, "position = 0.8 at t = 1 s",
        0.8 - 0.1 / 2, 1e-5, "at least 0.749, because of position = 0 at t = 0 s; velocity = 0 at t = 0 s; force (up"),
    **{f"who cannot brake, {claim}": (WEAK, claim, FAST, *BRAKE) for claim in CLAIMS},
    **{f"too short a way from {t} s": (MOVING, (t, t + 3.0), {}, *TOO_SHORT) for t in (0.0, -100.0, -0.04, 1e9)},
    "bounds that move": (between(LINES({1.0: -1.0, 1.5: 0.6}), LINES({1.0: -0.5, 1.4: 1.0})), (0.0, 4.0), {},
        "", 0.0, np.inf, "position (lower bound"),
    **{f"a free state at {t} s": (FREE, "all_times", {t: REST, t + 1.0: {"position": 0.8}},
        f"position = 0.8 at t = {1 + t:g} s", 0.75, 1e-5, "") for t in (0.0, 0.35)},
    # After two steps, at most what the largest level and inflow and the smallest outflow leave: boxes know no more.
    "a level": (filled(0.3), "all_times", {0.0: {"level": 0.2}, 10.0: {"level": 1.9}}, "level = 1.9 at t = 10 s",
        1.9 - (AFTER_A_STEP + 2.5 * (0.3 - 0.6 * np.sqrt(0.1))), 1e-3,
        "because of level = 0.2 at t = 0 s; level in [0.1, 2]; inflow in [0, 0.3]"),
    # The outflow is 0.6 √0.1 at least: what is left of 2 m is below 0.1 m in the sixth step.
    "a window in which a tank runs empty": (filled(0.05), (0.0, 270.0), {}, "level in [0.1, 2] at t = 30 s", 0.2, 0.01,
        "level in [0.1, 2] at t = 30 s is out of reach by at least 0.19"),
    "in a long window": (filled(0.6), (0.0, 700.0), {5.0: {"level": 1.0}, 600.0: {"level": 0.2}, 605.0: {"level": 1.9}},
        "level = 1.9 at t = 605 s", 0.0, np.inf, ""),
    "a free state of which a value is given": (PRODUCT, (0.0, 9.0), {0.0: {"a": 0.5, "b": 2.0}, 1.0: {"b": 50.0}},
        "b = 50 at t = 1 s", 50.0 - 1.1, 1e-6, ""),
    "beside a free state": (PRODUCT, (0.0, 9.0), {0.0: {"a": 0.5}, 1.0: {"b": 50.0}, 2.0: {"a": 0.8}},
        "a = 0.8 at t = 2 s", 0.1, 1e-6, ""),
    "from one value to another": (added([205.0, -1e13], [210.0, 1e13], LEAKS), (0.0, 1.0),
        {0.0: {"a": -90.0}, 1.0: {"a": 90.0}}, "a = 90 at t = 1 s", 25.0, 1e-4, ""),
}  # fmt: skip
NOT_TOLD: dict[str, tuple[ConstrainedSystem, Written, Waypoints]] = {
    **{f"who can brake, {claim}": (WEAK, claim, SLOW) for claim in CLAIMS},
    **{f"way enough from {t} s": (MOVING, (t, t + 1.3), {}) for t in (0.0, -100.0, -0.04, 1e9)},
    "bounds that draw in": (between(-1.0, PolynomialPieces.steps({0.0: 1.0, 2.0: 0.5})), (0.0, 4.0), {}),
    "slower": (between(LINES({1.0: -1.0, 3.5: 0.6}), LINES({1.0: -0.5, 3.4: 1.0})), (0.0, 4.0), {}),
    "times that steps do not link": (WEAK, "all_times", {0.0: {"position": 0.0}, 0.025: {"position": 0.9}}),
    "a level in reach": (filled(0.3), "all_times",
        {0.0: {"level": 0.2}, 10.0: {"level": AFTER_A_STEP + 2.5 * (0.3 - 0.6 * np.sqrt(AFTER_A_STEP))}}),
    "before the tank is empty": (filled(0.05), (0.0, 24.0), {}),
    "a root of zero, which may not be defined": (filled(0.05, low=0.0), (0.0, 270.0), {}),
    "a low level": (filled(0.6), "all_times", {100.0: {"level": 0.2}, 105.0: {"level": 0.9}, 500.0: {"level": 1.0}}),
    "a free state": (PRODUCT, (0.0, 9.0), {0.0: {"a": 0.5}, 1.0: {"b": 50.0}}),
    "a small entry of a row": (added([5.0, -1e11], [10.0, 1e11], LEAKS), (0.0, 1.0), {}),
    "rows of several states": (added([205.0, -1e13], [210.0, 1e13], LEAKS), (0.0, 1.0), {}),
}  # fmt: skip


def assert_all_is_told(found: Impossible) -> None:
    """Hardly more than what is told to be missing is accepted."""
    assert isinstance(check(found.contradiction), Contradicted)
    assert isinstance(check({**found.contradiction, "missing": 1.01 * found.missing}), Failed)


@pytest.mark.parametrize("name", TOLD)
def test_what_is_impossible_is_told_with_what_is_missing(name):
    *question, given, missing, within, sentence = TOLD[name]
    found = told(*question)
    assert found.given == given
    assert found.missing == pytest.approx(missing, abs=within)
    assert sentence in found.explanation
    assert_all_is_told(found)


@pytest.mark.parametrize("name", NOT_TOLD)
def test_what_may_be_possible_is_not_called_impossible(name):
    assert told(*NOT_TOLD[name]) is None


@pytest.mark.parametrize("seed", SEEDS)
def test_in_any_units_all_that_is_missing_is_told(seed):
    """Of states that are drawn one step apart: few inputs can link them."""
    rng = np.random.default_rng(seed)
    plant = random_plant(rng)
    names, n = plant.system.states, len(plant.system.states)
    at = {
        t: {name: rng.uniform(-1, 1) / (n + 1) * plant.state_set.extent(i).upper for i, name in enumerate(names)}
        for t in (0.3, 0.4)
    }
    assert_all_is_told(told(plant, (0.0, 1.0), at))


@pytest.mark.parametrize("seed", SEEDS)
def test_what_a_trajectory_does_is_never_called_impossible(seed):
    """Only tightened bounds exclude it, and only in their own words; no multipliers do, whatever proposes them."""
    rng = np.random.default_rng(seed)
    plant, claim, at = trajectory(rng)
    given = claim, waypoints(at, 1e-9, plant, claim), [0.0] * plant.signal_count
    assert impossible(plant, *given) is None
    drawn = tightening(plant, margin=float(rng.uniform(0.05, 0.45)))
    found = impossible(drawn.plant, *given, drawn)
    assert found is None or isinstance(found, InfeasibleTightening)
    with telling("multipliers are any numbers", np.random.default_rng(seed), OF_CONTRADICTIONS):
        assert impossible(plant, *given) is None


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    ("system", "start", "low", "high"),
    [(tank(5.0), [1.0], 0.4, 1.0), (two_tanks(1.0), [1.0, 1.0], 0.2, 1.0), (pendulum(0.05), [0.0, 0.0], -1.0, 1.0)],
)
def test_what_a_trajectory_of_a_formula_does_is_never_called_impossible(system, start, low, high, seed):
    rng = np.random.default_rng(seed)
    states, inputs, h = [np.array(start)], rng.uniform(low, high, (11, len(system.inputs))), system.sampling_time
    for u in inputs:
        states.append(system.successor(states[-1], u))
    sets = [Polytope.box(np.min(of, axis=0) - 1e-3, np.max(of, axis=0) + 1e-3) for of in (states, inputs)]
    at = {h * k: dict(zip(system.states, x.tolist(), strict=True)) for k, x in enumerate(states) if rng.random() < 0.5}
    assert told(ConstrainedSystem(system, *sets), (0.0, h * 11), at) is None


OUT_OF_REACH = {"noise_std": 0.02, "at": {0.0: REST, 1.0: {"position": 0.8}}}


@pytest.mark.parametrize("learn", [learn_reference, partial(learn_stream, window=2.0)])
def test_nothing_is_learned_where_nothing_is_possible(learn):
    with pytest.raises(NotTrackableError, match=r"no reference exists.* is out of reach by at least") as raised:
        learn(SAMPLES, WEAK, KERNEL, "all_times", **OUT_OF_REACH)
    assert isinstance(raised.value.outcome, Impossible)


FIRST = ConstrainedSystem(
    LinearSystem([[0.9]], [[1.0]], states=("x",), sampling_time=0.1), Polytope.box([-10], [10]), Polytope.box([-1], [1])
)
JUMP = {1.0: {"x": -0.460756}, 1.1: {"x": 0.506832}}  # by the input 0.921512
FAR = {1.0: {"x": -0.460756}, 1.1: {"x": 0.8}}  # by the input 1.214680
PUSHED = Zonotope.box([-0.1], [0.1])
DRAWN_IN = {
    "another feedback=": {"disturbance": PUSHED},
    "a smaller margin=": {"margin": 0.05},
    "another feedback= or a smaller margin=": {"disturbance": PUSHED, "margin": 0.01},
}


def refusal(at: Waypoints, **options: Any) -> Any:
    times = np.arange(0, 2.4, 0.1)
    samples = Samples(times, 0.3 * np.sin(2 * times))
    with pytest.raises(NotTrackableError) as raised:
        learn_reference(samples, FIRST, SquaredExponential(), "all_times", noise_std=0.05, at=at, **options)
    return raised.value.outcome


@pytest.mark.parametrize("instead", DRAWN_IN)
def test_only_what_the_own_bounds_exclude_is_impossible_whatever_the_feedback_and_the_margin(instead):
    options = DRAWN_IN[instead]
    outcome = refusal(JUMP, **options)
    assert isinstance(outcome, InfeasibleTightening)
    assert not isinstance(outcome, Impossible)
    assert "no reference exists" not in outcome.explanation
    assert f"; {instead} may leave more room: x = 0.506832 at t = 1.1 s is out of reach" in outcome.explanation
    outcome = refusal(FAR, at_tolerance=1e-3, **options)
    assert isinstance(outcome, Impossible)
    assert outcome == refusal(FAR, at_tolerance=1e-3)


def test_what_is_told_can_be_saved_as_the_file_that_the_checker_accepted(tmp_path):
    error = NotTrackableError(told(*TOLD["a value"][:3]))
    error.save_contradiction(file := tmp_path / "impossible.json")
    assert file.read_bytes() == accepted_file(error.outcome)
    assert isinstance(check(file), Contradicted)


def test_what_the_checker_does_not_accept_is_not_called_impossible():
    outcome = told(*TOLD["a value"][:3])
    twice = {**outcome.contradiction, "missing": 2 * outcome.missing}
    more = NotTrackableError(replace(outcome, contradiction=twice))
    assert more.outcome.explanation.startswith("it is not shown that no reference exists")
