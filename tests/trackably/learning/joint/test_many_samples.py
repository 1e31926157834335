"""Many samples: a search over hyperparameters alone ends as soon as it cannot be better than a known function."""

from dataclasses import replace

import numpy as np
import pytest

from tests.trackably.learning.joint.instances import Case
from tests.trackably.learning.joint.test_learn import INSTANCES, problem_of
from trackably import ConstrainedSystem, LinearSystem, Polytope, Samples, SquaredExponential, learn_reference
from trackably.gp.joint import JointPrior
from trackably.gp.kernels.matern import Matern32
from trackably.gp.prior import Prior
from trackably.learning.index_set import Steps
from trackably.learning.joint import search
from trackably.learning.joint.exchange import exchange_bounds, no_places
from trackably.learning.joint.places import MarginScan, fewer
from trackably.learning.problem import ConstrainedProblem, Solution
from trackably.learning.search import best_solution, better_solution


def free_of(problem: ConstrainedProblem) -> Solution:
    found = best_solution(replace(problem, constraints=()))
    assert isinstance(found, Solution)
    return found


@pytest.mark.parametrize("name", INSTANCES)
def test_a_ceiling_above_the_best_hides_nothing_and_one_below_ends_the_search(name):
    problem = problem_of(name)
    free, whole = free_of(problem), better_solution(problem, free_of(problem), np.inf)
    if whole is None:
        pytest.skip("the prior mean is no solution's neighbour")
    above = better_solution(problem, free, whole.objective + 1e-6)
    assert above is not None
    assert above.objective == whole.objective
    below = better_solution(problem, free, whole.objective - 1e-6)
    assert below is None or below.objective < whole.objective - 1e-6
    at_once = better_solution(problem, free, free.objective)
    assert at_once is None


@pytest.mark.parametrize("name", ["tight_2", "tight_4"])
def test_the_exchange_ends_where_its_price_shows_that_j_is_no_smaller(name, monkeypatch):
    """J = l + D: the ceiling of the price D is what l leaves of the J of a point that is known."""
    known, examined = [], []

    def seen(problem, posterior, places, near, tolerance, ceiling):
        nlml, _ = posterior.negative_log_marginal_likelihood()
        found = exchange_bounds(problem, posterior, places, near, tolerance, ceiling)
        if np.isfinite(ceiling):
            examined.append(min(abs(nlml + ceiling - objective) for objective in known))
        known.append(nlml + found.mean.price)
        return found

    monkeypatch.setattr(search, "exchange_bounds", seen)
    problem = problem_of(name)
    joint = search.JointSearch(problem)
    joint.follow(free_of(problem).posterior.prior.log_hyperparameters)
    assert joint.best is not None
    assert len(examined) > 1
    assert max(examined) <= 1e-9 * max(map(abs, known))


def test_of_many_samples_function_and_hyperparameters_are_no_worse_than_these_alone(monkeypatch):
    times = 0.02 * np.arange(60.0)
    values = np.sin(2 * np.pi * times / 1.5) + 0.02 * np.random.default_rng(0).standard_normal(60)
    axis = LinearSystem.discretised([[0, 1], [0, 0]], [[0], [1]], 0.02, states=("position", "velocity"))
    plant = ConstrainedSystem(axis, Polytope.box([-2.0, -4.0], [2.0, 4.0]), Polytope.box([-40.0], [40.0]))
    asked = (Samples(times, values), plant, SquaredExponential(), (0.0, 1.18))
    whole = learn_reference(*asked, noise_std=(0.005, 0.5), starts=2)
    alone = learn_reference(*asked, noise_std=(0.005, 0.5), starts=2, method="hyperparameters")
    monkeypatch.setattr(search, "_MANY_SAMPLES", 10)
    many = learn_reference(*asked, noise_std=(0.005, 0.5), starts=2)
    assert many.method == "joint"
    assert many.objective < alone.objective - 1
    assert many.objective == pytest.approx(whole.objective, rel=1e-6)


@pytest.mark.parametrize(("bent", "is_given_up"), [(600, True), (400, False)])
def test_functions_that_break_bounds_though_bent_at_hundreds_of_times_end_the_search(bent, is_given_up, monkeypatch):
    """The first function keeps its bounds; those that steps lead to do not: shorter and shorter steps are tried."""
    counts: list[int] = []

    def seen(*asked):
        found = exchange_bounds(*asked)
        counts.append(0)
        if len(counts) == 1:
            return found
        return replace(found, margin=-0.1, mean=replace(found.mean, price=1e9), active=(np.zeros((bent, 2)),))

    monkeypatch.setattr(search, "exchange_bounds", seen)
    problem = problem_of("tight_2")
    joint = search.JointSearch(problem)
    start = free_of(problem).posterior.prior.log_hyperparameters
    point = joint._at(start, no_places(problem), None, 0.0)
    assert point is not None
    joint._descend(search._Descent(point, point.function.places), 0.0, 1e-4)
    assert (joint.fits == 1) is is_given_up


def held_for_long() -> ConstrainedProblem:
    """Speeds of 1.6 where 0.8 are allowed, with a kernel whose speeds are rough."""
    times = 0.1 * np.arange(150.0)
    values = 1.3 * np.sin(2 * np.pi * times / 5) + 0.05 * np.random.default_rng(0).standard_normal(150)
    plant = ConstrainedSystem(
        LinearSystem.scalar(1.0, 0.1, sampling_time=0.1), Polytope.box([-2.0], [2.0]), Polytope.box([-0.8], [0.8])
    )
    known = JointPrior((Prior(Matern32(2.0, 2.0), 0.1),))
    return Case((Samples(times, values),), known, plant, Steps(0, 2960, 0.005)).problem


def test_functions_that_are_held_to_their_bounds_for_long_are_found_at_few_places(monkeypatch):
    """Minima alone come one between two others, again and again."""
    problem = held_for_long()
    counts = {}
    for crowded in (20, np.inf):
        monkeypatch.setattr("trackably.learning.joint.exchange._CROWDED", crowded)
        found = exchange_bounds(problem, problem.posterior(np.empty(0)), no_places(problem), None, 3e-3)
        assert found is not None
        assert found.margin > -3e-3
        counts[crowded] = found
    assert sum(map(len, counts[20].active)) < 0.55 * sum(map(len, counts[np.inf].active))
    assert counts[20].mean.price == pytest.approx(counts[np.inf].mean.price, rel=1e-2)


def test_steps_take_few_of_many_places():
    many = np.column_stack([np.arange(3000.0), np.ones(3000)])
    (few,) = fewer((many,), (many,))
    assert 600 < len(few) <= 1200
    assert np.all(np.diff(few[:, 0]) == few[1, 0] - few[0, 0])
    assert fewer((many,), (many[:400],)) == (many,)


def test_minima_wait_until_regular_times_are_places():
    problem = held_for_long()
    seen, apart = MarginScan(problem.constraints, problem.posterior(np.empty(0)).signals), 0.1
    minima = seen.closest(no_places(problem))
    broken, _ = minima[1]
    known = np.column_stack([np.sort(broken) + 0.02, np.ones(len(broken))])
    for places in (no_places(problem), (np.empty((0, 2)), known)):
        times, margins = seen.thinned(minima, places, (1.0, apart), 1e-5)[1]
        is_regular = np.abs(times / apart - np.rint(times / apart)) < 1e-6
        assert np.count_nonzero(is_regular) > 20
        assert np.all(margins < -1e-5)
        others = np.concatenate([times[is_regular], places[1][:, 0]])
        assert all(np.min(np.abs(others - time)) > apart for time in times[~is_regular])
    every = np.column_stack([apart * np.arange(151), np.ones(151)])
    left, _ = seen.thinned(minima, (every, every), (apart, apart), 1e-5)[1]
    np.testing.assert_array_equal(left, broken[minima[1][1] < -1e-5])
