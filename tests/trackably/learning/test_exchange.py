"""Exchange against brute force: as good, never outside its bounds, the same every time, honest where it fails."""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.published.algorithm1 import tightened
from tests.trackably.gp.instances import over
from tests.trackably.learning import naive
from tests.trackably.learning.instances import TIGHT_SEEDS, Instance, instance, tight, wild
from trackably.gp.hyperparameter import Learned
from trackably.learning.problem import Solution
from trackably.learning.search import best_solution

ROUNDING = 1e-11


def assert_keeps_every_bound(case: Instance, solution) -> None:
    assert isinstance(solution, Solution), solution.explanation
    assert np.min(naive.margins(case, solution.posterior.prior.parts[0])) >= -ROUNDING
    assert case.smallest_margin(solution.posterior) >= 0


CASES = {f"wide {seed}": instance(seed) for seed in range(2)} | {f"tight {seed}": tight(seed) for seed in TIGHT_SEEDS}
CASES["learned noise"] = replace(CASES["wide 0"], prior=replace(CASES["wide 0"].prior, noise_std=Learned(0.03)))


@over(CASES, "case")
def test_every_bound_is_kept_and_no_point_of_a_dense_grid_is_better(case):
    found = best_solution(case.problem)
    assert_keeps_every_bound(case, found)
    assert found.objective <= naive.best_on_a_grid(case) + 1e-9


@pytest.mark.parametrize(("seed", "least"), [(87, 1643.4011), (119, 733.3205)])
def test_searches_that_may_still_lead_to_the_best_minimum_are_not_given_up(seed, least):
    """Slow ones: others would be the best if searches were given up sooner, or if steps learned less of curvature."""
    found = best_solution(tight(seed).problem)
    assert isinstance(found, Solution)
    assert found.objective == pytest.approx(least, rel=1e-6)


@pytest.mark.parametrize("seed", [0, 4])
def test_tightening_step_by_step_ends_where_solving_at_once_does(seed):
    case = instance(seed)
    stepwise = best_solution(replace(case, last=10).problem)
    for last in (20, 21, 60, 100):
        tighter = replace(case, last=last)
        stepwise = tightened(stepwise, tighter.problem)
        assert_keeps_every_bound(tighter, stepwise)
    assert stepwise.objective == pytest.approx(best_solution(case.problem).objective, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("seed", [0, 5])
def test_an_admissible_equilibrium_is_enough_whatever_the_samples(seed):
    """Notes, section 5: as θ₁ → 0 the mean tends to the prior mean, so that a feasible point exists."""
    case = wild(seed)
    assert_keeps_every_bound(case, best_solution(case.problem))
