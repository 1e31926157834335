"""Exchange against brute force: as good, never outside its bounds, the same every time, honest where it fails."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from tests.trackably.learning import naive
from tests.trackably.learning.instances import SEEDS, TIGHT_SEEDS, Instance, instance, tight, wild
from trackably.gp.hyperparameter import Learned
from trackably.gp.joint import JointPrior
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.learning.exchange import Exchange
from trackably.learning.index_set import Steps
from trackably.learning.nonlinear import Program
from trackably.learning.problem import Solution
from trackably.learning.search import best_solution, tightened

ROUNDING = 1e-11


def assert_keeps_every_bound(case: Instance, solution) -> None:
    assert isinstance(solution, Solution), solution.explanation
    assert np.min(naive.margins(case, solution.posterior.prior.parts[0])) >= -ROUNDING
    for constraint in case.problem.constraints:
        steps = np.arange(constraint.index_set.first, constraint.index_set.last + 1)
        margins = constraint.relative_margin(solution.posterior, steps * case.plant.sampling_time)
        assert np.all(margins >= 0)


@lru_cache
def _solved(seed: int) -> Solution:
    return best_solution(instance(seed).problem)


@pytest.fixture(params=SEEDS)
def seed(request) -> int:
    return request.param


@pytest.fixture
def case(seed) -> Instance:
    return instance(seed)


@pytest.fixture
def solution(seed) -> Solution:
    return _solved(seed)


def test_every_bound_is_kept_at_every_step(case, solution):
    assert_keeps_every_bound(case, solution)


def test_no_point_of_a_dense_grid_is_better(case, solution):
    assert solution.objective <= naive.best_on_a_grid(case) + 1e-9


def test_no_brute_force_from_many_starts_is_better(case, solution):
    assert solution.objective <= naive.best_of_many_starts(case) + 1e-6 * (1 + abs(solution.objective))


def test_what_no_look_meets_is_met_in_the_end(monkeypatch):
    """Blind but for the first step, the exchange still ends at a solution that keeps every bound, as good as ever."""
    plain = instance(SEEDS[0])
    fine = tuple(
        replace(
            c,
            index_set=replace(c.index_set, last=200 * c.index_set.last, sampling_time=plain.plant.sampling_time / 200),
        )
        for c in plain.problem.constraints
    )
    problem = replace(plain.problem, constraints=fine)
    seeing = best_solution(problem)
    assert isinstance(seeing, Solution)
    monkeypatch.setattr(Steps, "local_minima", lambda steps, margin, kernels: np.array([steps.first * 1.0]))
    blind = best_solution(problem)
    assert isinstance(blind, Solution)
    assert blind.objective == pytest.approx(seeing.objective, rel=1e-6, abs=1e-6)
    for constraint in fine:
        times = (
            np.arange(constraint.index_set.first, constraint.index_set.last + 1) * constraint.index_set.sampling_time
        )
        assert np.all(constraint.relative_margin(blind.posterior, times) >= 0)


def test_a_search_ends_where_it_comes_near_to_a_known_minimum(monkeypatch):
    problem = instance(SEEDS[0]).problem
    evaluated, evaluate = [], Program.evaluate
    monkeypatch.setattr(Program, "evaluate", lambda program, x: evaluated.append(x) or evaluate(program, x))
    exchange = Exchange(problem)
    exchange.together(problem.space.start_points()[:1])
    assert exchange.best is not None
    least, minimum, beside = exchange.best.objective, exchange.best.log_theta, exchange.best.log_theta + 0.02
    fresh = Exchange(problem)
    evaluated.clear()
    fresh.together([beside])
    assert fresh.best is not None
    assert fresh.best.objective == pytest.approx(least, abs=1e-6)
    alone = len(evaluated)
    evaluated.clear()
    exchange.together([beside])
    assert len(evaluated) < alone / 2
    assert exchange.best.log_theta is minimum


@pytest.mark.parametrize(("seed", "least"), [(87, 1643.4011), (119, 733.3205)])
def test_searches_that_may_still_lead_to_the_best_minimum_are_not_given_up(seed, least):
    """Slow ones: others would be the best if searches were given up sooner, or if steps learned less of curvature."""
    found = best_solution(tight(seed).problem)
    assert isinstance(found, Solution)
    assert found.objective == pytest.approx(least, rel=1e-6)


@pytest.mark.parametrize("seed", SEEDS[::2])
def test_tightening_step_by_step_ends_where_solving_at_once_does(case, solution):
    stepwise = best_solution(case.up_to(10).problem)
    for last in (20, 21, 60, 100):
        tighter = case.up_to(last)
        stepwise = tightened(stepwise, tighter.problem)
        assert_keeps_every_bound(tighter, stepwise)
    assert stepwise.objective == pytest.approx(solution.objective, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("seed", SEEDS[::2])
def test_a_warm_start_is_no_worse_than_the_point_it_starts_from(case, solution):
    warm = best_solution(case.problem, near=solution)
    assert_keeps_every_bound(case, warm)
    assert warm.objective <= solution.objective + 1e-9


@pytest.mark.parametrize("seed", TIGHT_SEEDS)
def test_no_point_of_a_dense_grid_is_better_in_tight_sets_either(seed):
    case = tight(seed)
    found = best_solution(case.problem)
    assert_keeps_every_bound(case, found)
    assert found.objective <= naive.best_on_a_grid(case) + 1e-9


def test_a_warm_start_in_tight_sets_is_no_worse_than_the_point_it_starts_from():
    problem = tight(0).problem
    cold = best_solution(problem)
    assert best_solution(problem, near=cold).objective <= cold.objective + 1e-9


@pytest.mark.parametrize("seed", SEEDS[::2])
def test_learned_noise_is_as_good_as_brute_force(seed):
    base = instance(seed)
    prior = replace(base.prior, noise_std=Learned(base.prior.noise_std))
    free = replace(base, prior=prior)
    found = best_solution(replace(free.problem, constraints=()))
    assert found.objective <= naive.best_of_many_starts(free, starts=20, constrained=False) + 1e-5


@pytest.mark.parametrize("seed", [0, 1, 4])
def test_learned_noise_under_constraints_is_as_good_as_brute_force(seed):
    base = instance(seed)
    case = replace(base, prior=replace(base.prior, noise_std=Learned(base.prior.noise_std)))
    found = best_solution(case.problem)
    assert_keeps_every_bound(case, found)
    assert found.objective <= naive.best_of_many_starts(case) + 1e-6 * (1 + abs(found.objective))


@pytest.mark.parametrize("seed", SEEDS[:6])
def test_an_admissible_equilibrium_is_enough_whatever_the_samples(seed):
    """Notes, section 5: as θ₁ → 0 the mean tends to the prior mean, so that a feasible point exists."""
    case = wild(seed)
    assert_keeps_every_bound(case, best_solution(case.problem))


def test_with_nothing_to_learn_the_prior_itself_is_tried():
    base = instance(0)
    quiet = replace(base.prior, kernel=SquaredExponential(1e-3, 0.3))
    assert quiet.learned == ()
    answer = best_solution(replace(base, prior=quiet).problem)
    assert isinstance(answer, Solution)
    assert answer.posterior.prior == JointPrior((quiet,))
