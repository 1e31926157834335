"""The printed numbers of Example 1."""

import numpy as np
import pytest

from pipeline.published.algorithm1 import SOUND, algorithm1
from pipeline.published.scalar import reachable_tube, successor_set
from pipeline.storage.results import read_numbers
from tests.pipeline.published import example1
from tests.pipeline.published.example1 import INPUT_SET, PUBLISHED, STATE_SET, STEPS, SYSTEM
from tests.project import ROOT
from trackably.learning.problem import Solution
from trackably.systems.reference import Reference
from trackably.work import Work, watch

IDENTIFIED = 5e-7 + 1e-6
"""Half a unit of the last digit that the notes give, and room for the optimiser."""


def reference(solution: Solution) -> Reference:
    return Reference(solution.posterior.signals, SYSTEM)


def states(solution: Solution):
    return reference(solution).state(STEPS)[:, 0]


def test_the_optima_are_the_identified_ones(unconstrained, run):
    for solution, identified in (
        (unconstrained, (0.659325, 0.203472, -3.855397)),
        (run.outcome, (0.701178, 0.219672, -3.716033)),
    ):
        theta = solution.posterior.prior.hyperparameters
        found = theta["signal_std"], theta["lengthscale"], solution.objective
        assert found == pytest.approx(identified, abs=IDENTIFIED)


def test_iterations_are_the_committed_ones(as_published):
    """Which the claims compare with the printed ones: where each test first holds, and all 61 bounds."""
    committed = read_numbers(ROOT / "data" / "results" / "example1" / "iterations.csv")
    found = as_published.trace
    for name, values in committed.items():
        np.testing.assert_allclose(found[name], values, rtol=1e-6, err_msg=name)


def test_published_means(unconstrained, run):
    for solution, name in ((unconstrained, "mean_unconstrained"), (run.outcome, "mean_constrained")):
        np.testing.assert_allclose(states(solution), PUBLISHED[name], atol=1e-5)


def test_published_tube_is_the_successor_set_of_the_constrained_mean(as_published, unconstrained):
    """The unconstrained mean, whose steps outside of the state set are claims, leaves its own tube nowhere."""
    x = states(unconstrained)
    low, high = successor_set(SYSTEM, x[:-1])
    assert np.all((low < x[1:]) & (x[1:] < high))
    learned = reference(as_published.outcome)
    low, high = reachable_tube(learned, learned.instants(STEPS))
    np.testing.assert_allclose(low, PUBLISHED["successor_lower"], atol=6e-5)
    np.testing.assert_allclose(high, PUBLISHED["successor_upper"], atol=6e-5)


def test_the_constrained_mean_touches_the_state_bound_at_one_step_only(run):
    learned = reference(run.outcome)
    steps = np.arange(1000)
    margins = STATE_SET.margin(learned.state(steps))
    assert np.all(margins >= 0)
    assert np.count_nonzero(margins < 1e-7) == 1
    assert np.all(INPUT_SET.margin(learned.input(steps)) > 0)


def test_growth_rates_of_the_two_readings_serve_different_states(as_published, sound):
    for run, centre_of in (
        (as_published, lambda i: float(i.solution.posterior.signals[0](i.tail.start))),
        (sound, lambda _: 0),
    ):
        last = run.iterations[-1]
        centre, bound, t_s = centre_of(last), last.tail.mean_bound, 0.01
        # x⁺ − x = −0.1 x + 0.5 u with |u| ≤ 0.5: growing is hardest at the upper end, falling at the lower.
        expected = ((-0.25 - 0.1 * (centre - bound)) / t_s, (0.25 - 0.1 * (centre + bound)) / t_s)
        assert last.growth_rates == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(("name", "state_lag", "input_lag"), [("as_published", 1, 2), ("sound", 0, 1)])
def test_every_iteration_keeps_what_it_constrains(name, state_lag, input_lag, request):
    for iteration in request.getfixturevalue(name).iterations:
        learned = reference(iteration.solution)
        k = iteration.k_bar
        assert np.all(STATE_SET.margin(learned.state(np.arange(k - state_lag + 1))) >= 0)
        assert np.all(INPUT_SET.margin(learned.input(np.arange(k - input_lag + 1))) >= 0)
    objectives = [iteration.solution.objective for iteration in request.getfixturevalue(name).iterations]
    assert np.all(np.diff(objectives) >= -1e-8)


def test_giving_up_says_which_test_failed():
    heard: list[Work] = []
    with watch(heard.append):
        run = algorithm1((example1.SAMPLES,), example1.PRIOR, SYSTEM, example1.SPACE, SOUND, 70, 72)
    assert [iteration.k_bar for iteration in run.iterations] == [70, 71, 72]
    assert heard.count("fit") == 3
    assert run.outcome is None
    assert run.iterations[-1].tail is None
    assert "at k̄ = 72 a sample still lies within ζ = 0.20" in run.explanation
