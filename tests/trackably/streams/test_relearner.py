"""Learning in the loop from public names: windows are proved, late ones are told, and the old reference stays."""

from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from tests.trackably.plants import AXIS
from tests.trackably.saved import assert_comes_back
from trackably import (
    BudgetExceeded,
    Controller,
    Infeasible,
    Plan,
    Proved,
    Relearner,
    Samples,
    SquaredExponential,
    TrackableReference,
    Zonotope,
    check,
    learn_reference,
)

KERNEL = SquaredExponential(0.5, 0.5)
TIMES = 0.2 * np.arange(24)  # s
VALUES = -0.45 + 0.68 * np.sin(TIMES) + 0.02 * np.random.default_rng(3).standard_normal(TIMES.size)
RATES = 0.68 * np.cos(TIMES) + 0.02 * np.random.default_rng(4).standard_normal(TIMES.size)
OPTIONS: dict[str, Any] = {"noise_std": 0.02, "mean": -0.4, "starts": 1, "progress": False}


def window(first: int, values: np.ndarray = VALUES) -> Samples:
    chosen = slice(first, first + 12)
    return Samples(TIMES[chosen], values[chosen])


@pytest.fixture(scope="module")
def learned() -> TrackableReference:
    return learn_reference(window(0), AXIS, KERNEL, "all_times", **OPTIONS)


def test_each_window_gives_what_learn_reference_does_and_the_checker_proves_it(learned, tmp_path):
    relearn = Relearner(learned)
    for i in (2, 4):
        found, anew = relearn(window(i)), learn_reference(window(i), AXIS, KERNEL, "all_times", **OPTIONS)
        assert isinstance(found, TrackableReference)
        assert relearn.reference is learned
        k = np.arange(100)
        np.testing.assert_allclose(found.state(k), anew.state(k), atol=1e-3)
        assert found.objective == pytest.approx(anew.objective, abs=1e-3)
        assert found.active_bounds
        assert found.misfit == pytest.approx(anew.misfit, rel=1e-2)
    assert_comes_back(found, tmp_path)
    assert isinstance(check(tmp_path / "proof.json"), Proved)
    assert len(relearn.seconds) == 2


def test_a_late_result_does_not_replace_the_reference(learned):
    ticks = iter([0.0, 2.0, 2.0, 2.5])
    relearn = Relearner(learned, budget=1.0, clock=lambda: next(ticks))
    late = relearn(window(2))
    assert isinstance(late, BudgetExceeded)
    assert relearn.reference is learned
    assert isinstance(relearn(window(4)), TrackableReference)
    assert relearn.seconds == [2.0, 0.5]


def recorded(steps: int) -> tuple[Controller, Mock]:
    """A controller, and the same one with a record of the references along which it planned."""
    controller = Controller(AXIS, steps, np.eye(2), np.eye(1))
    return controller, Mock(wraps=controller)


def references(controller: Mock) -> list[TrackableReference]:
    return [call.args[2] for call in controller.step.call_args_list]


def test_a_step_switches_if_a_plan_ends_on_the_new_reference(learned):
    relearn, (plain, controller) = Relearner(learned), recorded(20)
    found, k = relearn(window(2)), 40
    answer = relearn.step(controller, k, learned.state(k))
    assert isinstance(answer, Plan)
    assert relearn.reference is found
    np.testing.assert_array_equal(answer.inputs, plain.step(k, learned.state(k), found).inputs)
    relearn.step(controller, k + 1, found.state(k + 1))
    assert references(controller) == [found, found]


def test_a_reference_that_the_controller_refuses_is_not_tracked(learned):
    """The new one lies 0.3 m off: two steps do not lead there."""
    brief, controller = recorded(2)
    relearn, k = Relearner(learned), 40
    found = relearn(window(2, VALUES - 0.3))
    assert isinstance(brief.step(k, learned.state(k), found), Infeasible)
    assert relearn.step(brief, k, learned.state(k)).cost == pytest.approx(0.0, abs=1e-12)
    assert relearn.reference is learned
    relearn.step(controller, k, learned.state(k))
    assert references(controller) == [learned]  # it was tried once


def test_hyperparameters_are_learned_again_in_windows_that_are_to_move_them():
    first = learn_reference(window(0), AXIS, SquaredExponential(), "all_times", **OPTIONS)
    still, moved = Relearner(first)(window(2)), Relearner(first, moving_every=1)(window(2))
    assert still.hyperparameters == first.hyperparameters
    assert moved.hyperparameters != first.hyperparameters
    assert moved.objective <= still.objective


def test_room_for_disturbances_is_left_in_every_window(tmp_path):
    pushed = Zonotope.box([0.0, -0.005], [0.0, 0.005])
    first = learn_reference(window(0), AXIS, KERNEL, "all_times", disturbance=pushed, **OPTIONS)
    found = Relearner(first)(window(2))
    assert found.tightening is first.tightening
    found.save_certificate(tmp_path / "certificate.json")
    verdict = check(tmp_path / "certificate.json")
    assert isinstance(verdict, Proved)
    assert "disturbance" in verdict.statement


def test_states_that_show_one_signal_keep_their_own_noise():
    known = {**OPTIONS, "noise_std": {"position": 0.02, "velocity": 0.05}}
    soon, later = ({"position": window(first), "velocity": window(first, RATES)} for first in (0, 2))
    first, anew = (learn_reference(samples, AXIS, KERNEL, "all_times", **known) for samples in (soon, later))
    found = Relearner(first, noise_std=known["noise_std"])(later)
    assert found.objective == pytest.approx(anew.objective, abs=1e-3)
    with pytest.raises(ValueError, match=r"noise_std: expected a number for each of position and velocity"):
        Relearner(first)(later)
