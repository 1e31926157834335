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
from trackably.learning.joint.exchange import at_steps, exchange_bounds, no_places
from trackably.learning.joint.places import LOWER, UPPER, MarginScan
from trackably.learning.joint.sequential import with_backoff
from trackably.learning.problem import ConstrainedProblem, Solution, gap_allowed
from trackably.learning.search import best_solution, solution_from


def free_of(problem: ConstrainedProblem) -> Solution:
    found = best_solution(replace(problem, constraints=()))
    assert isinstance(found, Solution)
    return found


@pytest.mark.parametrize("name", INSTANCES)
def test_a_ceiling_above_the_best_hides_nothing_and_one_below_ends_the_search(name):
    problem = problem_of(name)
    free = free_of(problem)
    starts = [free.posterior.prior.log_hyperparameters, *free.others]
    whole = solution_from(starts, problem)
    if not isinstance(whole, Solution):
        pytest.skip("the prior mean is no solution's neighbour")
    above = solution_from(starts, problem, whole.objective + 1e-6)
    assert isinstance(above, Solution)
    assert above.objective == whole.objective
    below = solution_from(starts, problem, whole.objective - 1e-6)
    assert not isinstance(below, Solution) or below.objective < whole.objective - 1e-6
    assert not isinstance(solution_from(starts, problem, free.objective), Solution)


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


@pytest.mark.filterwarnings("ignore::trackably.IgnoresSamplesWarning")
def test_small_gains_do_not_count_where_more_places_are_active_than_there_are_samples(monkeypatch):
    """Six samples of a sine whose accelerations are at their bounds most of the time: each step in θ takes long."""
    times, exchanged = np.linspace(0.0, 3.0, 6), []
    axis = LinearSystem.discretised([[0, 1], [0, 0]], [[0], [1]], 0.1, states=("position", "velocity"))
    plant = ConstrainedSystem(axis, Polytope.box([-0.8, -9.0], [0.8, 9.0]), Polytope.box([-2.63], [2.63]))
    asked = (Samples(times, np.sin(2 * np.pi * times / 3)), plant, SquaredExponential(), (0.0, 2.6))

    def exchange(*given):
        exchanged.append(exchange_bounds(*given))
        return exchanged[-1]

    monkeypatch.setattr(search, "exchange_bounds", exchange)
    found, counts = [], []
    for many in (10**6, 10):
        monkeypatch.setattr(search, "_MANY_FOR_STEPS", many)
        exchanged.clear()
        found.append(learn_reference(*asked, noise_std=0.01, mean=0.0, starts=1).objective)
        counts.append(len(exchanged))
    assert found[1] == pytest.approx(found[0], rel=1e-3)
    assert counts[1] < counts[0]


def held_for_long(fastest: float = 0.8, learned: bool = False) -> ConstrainedProblem:
    """Speeds of 1.6 where less are allowed, with a kernel whose speeds are rough."""
    times = 0.1 * np.arange(150.0)
    values = 1.3 * np.sin(2 * np.pi * times / 5) + 0.05 * np.random.default_rng(0).standard_normal(150)
    plant = ConstrainedSystem(
        LinearSystem.scalar(1.0, 0.1, sampling_time=0.1),
        Polytope.box([-2.0], [2.0]),
        Polytope.box([-fastest], [fastest]),
    )
    prior = Prior(Matern32(), (0.01, 10.0)) if learned else Prior(Matern32(2.0, 2.0), 0.1)
    return Case((Samples(times, values),), JointPrior((prior,)), plant, Steps(0, 2960, 0.005)).problem


def test_an_exchange_ends_where_the_next_back_off_removes_what_is_left(monkeypatch):
    """With that back-off bounds are kept, and J is no further from its least value than allowed."""
    problem = held_for_long()
    posterior = problem.posterior(np.empty(0))
    early = exchange_bounds(problem, posterior, no_places(problem))
    monkeypatch.setattr("trackably.learning.joint.exchange._OF_BACKOFF", 0.0)
    precise = exchange_bounds(problem, posterior, no_places(problem))
    assert early.rounds < precise.rounds
    assert early.margin < 0
    allowed = gap_allowed(early.mean.price)
    drawn_in = with_backoff(problem, allowed / early.mean.rise)
    kept = exchange_bounds(drawn_in, posterior, early.places, early.mean.signals)
    assert np.all(MarginScan(problem.constraints, kept.mean.signals).closest(kept.places)[1][1] >= 0)
    assert early.mean.price <= precise.mean.price <= kept.mean.price <= early.mean.price + 1.1 * allowed


def test_what_bounds_cut_off_counts_as_noise_at_the_start_of_a_search():
    """A search begins where J is far smaller than at the likeliest hyperparameters; there, where bounds are wide."""
    for fastest in (0.3, 3.0):
        problem = held_for_long(fastest, learned=True)
        likeliest = free_of(problem).posterior.prior.log_hyperparameters
        of = search.JointSearch(problem)
        begun = of._with_noise(likeliest)
        np.testing.assert_array_equal(begun[:-1], likeliest[:-1])
        if fastest > 1.6:
            np.testing.assert_array_equal(begun, likeliest)
        else:
            assert begun[-1] >= likeliest[-1] + np.log(4)
            there, before = (of._at(log_theta, no_places(problem), None, 3e-3) for log_theta in (begun, likeliest))
            assert there.objective < before.objective - 100


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


@pytest.mark.parametrize("seed", range(5))
def test_no_place_is_lost_because_it_is_moved_beside_a_known_one(seed):
    """A violated bound would come back in each round, and no place would ever be added for it."""
    problem, rng, same = held_for_long(), np.random.default_rng(seed), 4e-3
    known, new = (
        tuple(np.column_stack([np.sort(rng.uniform(0, 14.8, 200)), rng.choice([LOWER, UPPER], 200)]) for _ in range(2))
        for _ in range(2)
    )
    moved = at_steps(problem, new, known, same)
    assert not all(map(np.array_equal, moved, new))
    for of_new, of_moved, of_known in zip(new, moved, known, strict=True):
        for before, after in zip(of_new, of_moved, strict=True):
            beside = np.any((np.abs(of_known[:, 0] - after[0]) <= same) & (of_known[:, 1] == after[1]))
            assert not beside or np.array_equal(before, after)
