"""The printed numbers of Example 1."""

import numpy as np
import pytest

from pipeline.published.algorithm1 import SOUND, Run, algorithm1
from pipeline.published.scalar import reachable_tube, successor_set
from tests.pipeline.published import example1
from tests.pipeline.published.example1 import INPUT_SET, PUBLISHED, STATE_SET, STEPS, SYSTEM
from trackably.learning.problem import Solution
from trackably.systems.reference import Reference
from trackably.work import Work, watch

IDENTIFIED = 5e-7 + 1e-6
"""Half a unit of the last digit that the notes give, and room for the optimiser."""


def theta(solution: Solution) -> list[float]:
    values = solution.posterior.prior.hyperparameters
    return [values["signal_std"], values["lengthscale"]]


def reference(solution: Solution) -> Reference:
    return Reference(solution.posterior.signals, SYSTEM)


def states(solution: Solution):
    return reference(solution).state(STEPS)[:, 0]


def first(run: Run, holds) -> int:
    """The first k̄ from which on a test holds at every iteration."""
    fails = [i.k_bar for i in run.iterations if not holds(i)]
    return max(fails) + 1


def test_unconstrained_optimum(unconstrained):
    assert theta(unconstrained) == pytest.approx([0.659325, 0.203472], abs=IDENTIFIED)
    assert theta(unconstrained) == pytest.approx([0.65931, 0.20347], abs=4e-5)  # as printed
    assert unconstrained.objective == pytest.approx(-3.855397, abs=IDENTIFIED)


def test_constrained_optimum(run):
    assert theta(run.outcome) == pytest.approx([0.701178, 0.219672], abs=IDENTIFIED)
    assert theta(run.outcome) == pytest.approx([0.70117, 0.21967], abs=4e-5)  # as printed
    assert run.outcome.objective == pytest.approx(-3.716033, abs=IDENTIFIED)


def test_published_means(unconstrained, run):
    for solution, name in ((unconstrained, "mean_unconstrained"), (run.outcome, "mean_constrained")):
        np.testing.assert_allclose(states(solution), PUBLISHED[name], atol=1e-5)


def test_published_tube_is_the_successor_set_of_the_constrained_mean(as_published):
    learned = reference(as_published.outcome)
    low, high = reachable_tube(learned, learned.instants(STEPS))
    np.testing.assert_allclose(low, PUBLISHED["successor_lower"], atol=6e-5)
    np.testing.assert_allclose(high, PUBLISHED["successor_upper"], atol=6e-5)


def test_the_unconstrained_mean_leaves_the_state_set_but_never_the_tube(unconstrained):
    x = states(unconstrained)
    np.testing.assert_array_equal(STEPS[STATE_SET.margin(x) < 0], np.arange(77, 106))
    assert (int(np.argmax(x)), float(np.max(x))) == (90, pytest.approx(0.0917, abs=5e-5))
    low, high = successor_set(SYSTEM, x[:-1])
    assert np.all((low < x[1:]) & (x[1:] < high))


def test_the_constrained_mean_touches_the_state_bound_at_one_step_only(run):
    learned = reference(run.outcome)
    steps = np.arange(1000)
    margins = STATE_SET.margin(learned.state(steps))
    assert np.all(margins >= 0)
    assert np.count_nonzero(margins < 1e-7) == 1
    assert np.all(INPUT_SET.margin(learned.input(steps)) > 0)


def test_as_published_tests_first_hold_where_the_trace_says(as_published):
    assert [i.k_bar for i in as_published.iterations] == list(range(70, as_published.final_step + 1))
    assert as_published.explanation == ""
    assert as_published.iterations[-1].tail.mean_bound == pytest.approx(0.045841, abs=1.2e-4)
    assert first(as_published, lambda i: i.tail is not None) == 81
    assert first(as_published, lambda i: i.growth_rates and i.growth_rates[0] < 0 < i.growth_rates[1]) == 101
    assert first(as_published, lambda i: i.keeps_rates) == 108
    assert first(as_published, lambda i: i.keeps_states) == 130
    assert first(as_published, lambda i: i.terminates) == 130


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


def test_sound_bounds_hold_ever_after(sound):
    last = sound.iterations[-1]
    learned = reference(last.solution)
    later = last.tail.start + np.linspace(0, 10, 5001)
    x, u = learned.state_at(later), learned.input_at(later)
    assert np.all(np.abs(x) <= last.tail.mean_bound)
    assert STATE_SET.margin_of(last.tail.states) >= 0
    assert INPUT_SET.margin_of(last.tail.inputs(SYSTEM)) >= 0
    assert np.all(INPUT_SET.margin(u) > 0)


def test_giving_up_says_which_test_failed():
    heard: list[Work] = []
    with watch(heard.append):
        run = algorithm1((example1.SAMPLES,), example1.PRIOR, SYSTEM, example1.SPACE, SOUND, 70, 72)
    assert [iteration.k_bar for iteration in run.iterations] == [70, 71, 72]
    assert heard.count("fit") == 3
    assert run.outcome is None
    assert run.final_step is None
    assert run.iterations[-1].tail is None
    assert "at k̄ = 72 a sample still lies within ζ = 0.20" in run.explanation
