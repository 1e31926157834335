"""Learning function and hyperparameters together: never worse than hyperparameters alone, never outside its bounds."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.trackably.learning.instances import instance, tight, wild
from trackably.learning.joint.search import JointProgram, continued, learn_jointly
from trackably.learning.problem import ConstrainedProblem, Solution
from trackably.learning.search import best_solution

INSTANCES = {
    "loose_0": instance(0),
    **{f"tight_{seed}": tight(seed) for seed in (3, 4, 8)},
    "wild_0": wild(0),
}
names = pytest.mark.parametrize("name", INSTANCES)


def problem_of(name: str) -> ConstrainedProblem:
    problem = INSTANCES[name].problem
    return replace(problem, space=replace(problem.space, starts=2))


@cache
def jointly(name: str) -> Solution:
    found = learn_jointly(problem_of(name))
    assert isinstance(found, Solution), found.explanation
    return found


@cache
def alone(name: str) -> Solution:
    found = best_solution(problem_of(name))
    assert isinstance(found, Solution), found.explanation
    return found


@names
def test_is_never_worse_than_hyperparameters_alone(name):
    assert jointly(name).objective <= alone(name).objective + 1e-9 * (1 + abs(alone(name).objective))


@names
def test_bounds_are_kept_at_every_step(name):
    assert INSTANCES[name].smallest_margin(jointly(name)) >= 0


@names
def test_the_slope_of_j_is_zero_or_points_out_of_the_space(name):
    """In units in which a step of 1 in ln θ changes J by the slope."""
    found, problem = jointly(name), problem_of(name)
    theta = found.posterior.prior.log_hyperparameters
    slope = JointProgram(problem, found.active, found.signals, found.active).evaluate(theta).gradient
    down, up = theta > problem.space.log_lower + 1e-9, theta < problem.space.log_upper - 1e-9
    left = np.where(slope > 0, slope * down, slope * up)
    np.testing.assert_allclose(left, 0.0, atol=1e-4 * (1 + abs(found.objective)))


@pytest.mark.parametrize("name", ["loose_0", "tight_8"])
def test_tighter_bounds_cost_more(name):
    """Continued from the solution for wider bounds."""
    problem, found = problem_of(name), jointly(name)
    drawn = tuple(replace(c, backoff=1e-3) for c in problem.constraints)
    again = continued(found, replace(problem, constraints=drawn))
    assert isinstance(again, Solution)
    assert again.objective >= found.objective - 1e-9
    assert again.alone == found.alone == pytest.approx(alone(name).objective)
    assert INSTANCES[name].smallest_margin(again) >= 1e-3 * (1 - 1e-6)
