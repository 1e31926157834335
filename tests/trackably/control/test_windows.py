"""Windows learned again from where the last one ended: the same function as from nothing, proved, never too late."""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.loops.online import receding_window, simulate_online
from tests.pipeline.loops.test_online import CONTROLLER, STREAM, certified_by_search
from trackably.certificates.certified import Certified, learn_certified
from trackably.learning.joint.search import learn_function
from trackably.learning.learner import JOINT
from trackably.learning.problem import ConstrainedProblem, RequiredValue, UnmetBounds
from trackably.learning.space import SearchSpace
from trackably.streams.relearner import BudgetExceeded, WindowLearner

WINDOWS = [receding_window(STREAM, 0.8 + 0.1 * i, 8) for i in range(8)]


@pytest.fixture(scope="module")
def first() -> Certified:
    return certified_by_search(WINDOWS[0])


def ticking(*durations: float):
    """A clock by which windows take so long, one after the other."""
    times = iter([t for i, d in enumerate(durations) for t in (100.0 * i, 100.0 * i + d)])
    return lambda: next(times)


def test_the_function_is_the_one_that_is_found_from_nothing(first):
    """Its hyperparameters are known: then J has one minimum, up to the back-off at the places of its program."""
    learner = WindowLearner(first)
    known = first.solution.posterior.prior.as_known()
    for samples in WINDOWS[1:5]:
        space = SearchSpace.around(samples, known, starts=1)
        warm = learner(samples)
        cold = learn_certified(samples, known, first.reference.plant, space, learner=replace(JOINT, fallback=None))
        assert isinstance(warm, Certified)
        assert isinstance(cold, Certified)
        assert warm.solution.objective == pytest.approx(cold.solution.objective, abs=1e-3)
        t = np.linspace(0.0, 3.0, 50)  # s
        np.testing.assert_allclose(warm.reference.state_at(t), cold.reference.state_at(t), atol=1e-3)


def test_hyperparameters_that_move_make_the_objective_no_larger(first):
    """In every second window, beside the same window with those of the window before it."""
    learner = WindowLearner(first, moving_every=2)
    moved = []
    for samples in WINDOWS[1:5]:
        before = learner.last
        found, still = learner(samples), WindowLearner(before)(samples)
        assert isinstance(found, Certified)
        assert isinstance(still, Certified)
        assert found.solution.objective <= still.solution.objective + 1e-3
        values = [each.solution.posterior.prior.hyperparameters for each in (before, found)]
        moved.append(values[0] != pytest.approx(values[1], rel=1e-9))
    assert moved == [False, True, False, True]


def test_what_is_late_is_not_tracked_and_the_old_reference_stays(first):
    learner = WindowLearner(first, budget=1.0, clock=ticking(0.5, 1.5, 0.5))
    arrivals = [(90 + 10 * i, samples) for i, samples in enumerate(WINDOWS[1:4])]
    found = simulate_online(CONTROLLER, first, first.reference.state(0), 200, arrivals, learner)
    early, late, next_one = found.updates
    assert early.accepted
    assert next_one.accepted
    assert isinstance(late.learned, BudgetExceeded)
    assert not late.accepted
    assert late.reason == "not ready: learning and proof took 1.5 s, longer than the budget of 1 s"
    assert learner.seconds == [0.5, 1.5, 0.5]
    assert found.loop.first_infeasible_step is None
    before = found.loop.reference_states[100:110]
    np.testing.assert_allclose(before, early.learned.reference.state_at(0.01 * np.arange(100, 110)), atol=1e-12)


def test_given_values_that_contradict_each_other_find_no_function(first):
    known = first.solution.posterior.prior.as_known()
    space = SearchSpace.around(WINDOWS[0], known, starts=1)
    state = first.reference.quantities[0]
    required = tuple(RequiredValue(state.name, state.trajectory, 0.5, value, 1e-6) for value in (-1.0, -0.5))
    found = learn_function(ConstrainedProblem(WINDOWS[0], known, space, (), required))
    assert isinstance(found, UnmetBounds)
