"""References learned again while the loop runs: which ones are accepted, and that feasibility is never lost."""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.loops.online import OnlineLoop, decide_update, receding_window, simulate_online
from tests.trackably.certificates.references import certified
from trackably.certificates.certified import Certified, learn_certified
from trackably.certificates.goal import for_all_times
from trackably.certificates.outcome import Unproved
from trackably.checker.certificate import Window
from trackably.control.controller import TOLERANCE, Controller
from trackably.gp.joint import JointPrior
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.learning.learner import JOINT
from trackably.learning.problem import ConstrainedProblem
from trackably.learning.space import SearchSpace
from trackably.streams.relearner import LearningResult
from trackably.systems.intervals import Interval

PLANT = certified("example1").reference.plant
PRIOR = JointPrior((Prior(SquaredExponential(1.0, 1.0).as_learned(), noise_std=0.02),))
TIMES = np.arange(0.0, 3.01, 0.1)
NOISE = 0.02 * np.random.default_rng(5).standard_normal(TIMES.size)
STREAM = (Samples(TIMES, 0.6 * np.sin(2 * TIMES) - 0.5 + NOISE),)
CONTROLLER = Controller(PLANT, 10, np.eye(1), np.eye(1))
ARRIVALS = [(k, receding_window(STREAM, k * 0.01, 8)) for k in (120, 200, 300)]


def certified_by_search(samples: tuple[Samples, ...]) -> LearningResult:
    problem = ConstrainedProblem(samples, PRIOR, SearchSpace.around(samples, PRIOR, starts=2))
    return learn_certified(problem, PLANT, for_all_times(samples, PRIOR, PLANT), learner=JOINT)


@pytest.fixture(scope="module")
def first() -> Certified:
    return certified_by_search(receding_window(STREAM, 0.8, 8))


@pytest.fixture(scope="module")
def online(first) -> OnlineLoop:
    return simulate_online(CONTROLLER, first, first.reference.state(0), 600, ARRIVALS, certified_by_search)


def test_the_loop_stays_feasible_over_every_change_of_reference(online):
    assert not online.loop.infeasible
    moved = PLANT.system.successor(online.loop.states[:-1], online.loop.inputs)
    np.testing.assert_allclose(moved, online.loop.states[1:], atol=1e-12)
    assert len(moved) == 600
    accepted = [update for update in online.updates if update.taken]
    np.testing.assert_allclose(online.loop.reference_states[-1], online.reference.state(600), atol=1e-12)
    risen = online.loop.steps[1:][online.loop.cost_increases > 1e-12]
    assert {*risen.tolist()} <= {update.step for update in accepted}
    assert np.min(PLANT.state_set.margin(online.loop.states)) >= -1e-9
    assert np.min(PLANT.input_set.margin(online.loop.inputs)) >= 0


@pytest.fixture(scope="module")
def far() -> Certified:
    """A reference that the controller does not reach in a step."""
    return certified_by_search((Samples(TIMES[:8], np.full(8, -1.9)),))


SHORT = Controller(PLANT, 1, np.eye(1), np.eye(1))
REFUSED = {
    "no proof": (
        lambda first: Unproved("state", Interval(-2, 0.05), (1.0, 1.1), 1e-9, "too many boxes"),
        "learned, but not proved: ",
    ),
    "a window": (
        lambda first: replace(first, certificate=replace(first.certificate, claim=Window(0.0, 2.0))),
        "proved for all real t from 0 s to 2 s only",
    ),
}


@pytest.mark.parametrize(("offered", "reason"), REFUSED.values(), ids=REFUSED)
def test_what_is_not_proved_for_all_times_is_not_accepted(first, offered, reason):
    update = decide_update(SHORT, 30, first.reference.state(30), STREAM, offered(first))
    assert not update.taken
    assert update.reason.startswith(reason)


def test_a_loop_keeps_its_reference_where_another_one_is_out_of_reach(first, far):
    loop = simulate_online(SHORT, first, first.reference.state(0), 60, [(30, STREAM)], lambda _: far)
    (update,) = loop.updates
    assert not update.taken
    assert update.widening > 0.1
    assert update.reason.startswith("at step 30 ")
    assert loop.reference is first.reference
    assert not loop.loop.infeasible


def test_a_reference_within_the_controllers_tolerance_only_is_not_accepted(first):
    # With u in [-0.5, 0.5], one step leads to 0.9 x + 0.5 u, which has to be the next state of the reference.
    farthest = (first.reference.state(31) + 0.25) / 0.9
    updates = [decide_update(SHORT, 30, farthest + by, STREAM, first) for by in (-1e-6, 2e-8, 1e-6)]
    assert [update.taken for update in updates] == [True, False, False]
    assert updates[1].reason.startswith("within the tolerance only: ")
    assert 0 < updates[1].widening < TOLERANCE < updates[2].widening
