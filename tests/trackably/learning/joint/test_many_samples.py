"""Many samples: a search over hyperparameters alone ends as soon as it cannot be better than a known function."""

from dataclasses import replace

import numpy as np
import pytest

from tests.trackably.learning.joint.instances import Case
from tests.trackably.learning.joint.test_learn import INSTANCES, problem_of
from trackably import ConstrainedSystem, LinearSystem, Polytope, Samples
from trackably.gp.joint import JointPrior
from trackably.gp.kernels.matern import Matern32
from trackably.gp.prior import Prior
from trackably.learning.index_set import Steps
from trackably.learning.joint.exchange import at_steps, exchange_bounds, no_places
from trackably.learning.joint.places import LOWER, UPPER, MarginScan
from trackably.learning.joint.sequential import with_backoff
from trackably.learning.problem import ConstrainedProblem, Solution, gap_allowed
from trackably.learning.search import best_solution, solution_from


@pytest.mark.parametrize("name", INSTANCES)
def test_a_ceiling_above_the_best_hides_nothing_and_one_below_ends_the_search(name):
    problem = problem_of(name)
    free = best_solution(replace(problem, constraints=()))
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


def held_for_long() -> ConstrainedProblem:
    """Speeds of 1.6 where less are allowed, with a kernel whose speeds are rough."""
    times = 0.1 * np.arange(150.0)
    values = 1.3 * np.sin(2 * np.pi * times / 5) + 0.05 * np.random.default_rng(0).standard_normal(150)
    plant = ConstrainedSystem(
        LinearSystem.scalar(1.0, 0.1, sampling_time=0.1),
        Polytope.box([-2.0], [2.0]),
        Polytope.box([-0.8], [0.8]),
    )
    prior = JointPrior((Prior(Matern32(2.0, 2.0), 0.1),))
    return Case((Samples(times, values),), prior, plant, Steps(0, 2960, 0.005)).problem


def test_an_exchange_ends_where_the_next_back_off_removes_what_is_left():
    """With that back-off bounds are kept, and J is no further from its least value than allowed."""
    problem = held_for_long()
    posterior = problem.posterior(np.empty(0))
    early = exchange_bounds(problem, posterior, no_places(problem))
    assert early.margin < 0
    allowed = gap_allowed(early.mean.price)
    drawn_in = with_backoff(problem, allowed / early.mean.rise)
    kept = exchange_bounds(drawn_in, posterior, early.places, early.mean.signals)
    assert np.all(MarginScan(problem.constraints, kept.mean.signals).closest(kept.places)[1][1] >= 0)
    assert early.mean.price <= kept.mean.price <= early.mean.price + 1.1 * allowed


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
