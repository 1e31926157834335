"""Learning function and hyperparameters together: never worse than hyperparameters alone, never outside its bounds."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.trackably.learning.instances import instance, tight, wild
from trackably.checker.certificate import Window
from trackably.gp.joint import JointPrior
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.learning.index_set import RealTimes
from trackably.learning.joint.search import JointProgram, continued, learn_jointly
from trackably.learning.joint.sequential import keep_off_short_times
from trackably.learning.problem import ConstrainedProblem, Solution
from trackably.learning.search import best_solution
from trackably.learning.space import SearchSpace
from trackably.systems.intervals import Interval

INSTANCES = {
    **{f"loose_{seed}": instance(seed) for seed in (0, 1)},
    **{f"tight_{seed}": tight(seed) for seed in (2, 3, 4, 8)},
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
def test_the_price_is_what_the_bounds_cost(name):
    """J = l + D ≥ l, and no likelihood is better than the unconstrained one."""
    found = jointly(name)
    free = best_solution(replace(problem_of(name), constraints=()))
    assert found.price >= 0
    assert found.objective == pytest.approx(found.nlml + found.price, rel=1e-12)
    assert found.nlml == pytest.approx(found.posterior.negative_log_marginal_likelihood()[0], rel=1e-9, abs=1e-9)
    assert found.nlml >= free.objective - 1e-6 * (1 + abs(free.objective))


@names
def test_bounds_are_kept_at_every_step(name):
    found, case = jointly(name), INSTANCES[name]
    for constraint in case.problem.constraints:
        steps = np.arange(constraint.index_set.first, constraint.index_set.last + 1)
        assert np.min(constraint.relative_margin(found, steps * case.plant.sampling_time)) >= 0


@names
def test_the_slope_of_j_is_zero_or_points_out_of_the_space(name):
    """In units in which a step of 1 in ln θ changes J by the slope."""
    found, problem = jointly(name), problem_of(name)
    theta = found.posterior.prior.log_hyperparameters
    slope = JointProgram(problem, found.active, found.signals).evaluate(theta).gradient
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
    for constraint in drawn:
        steps = np.arange(constraint.index_set.first, constraint.index_set.last + 1)
        margins = constraint.relative_margin(again, steps * INSTANCES[name].plant.sampling_time)
        assert np.min(margins) >= 1e-3 * (1 - 1e-6)


def with_less_room(problem: ConstrainedProblem, by: float) -> ConstrainedProblem:
    """The problem with bounds that are closer by this part of their width."""
    drawn = [
        replace(c, quantity=replace(c.quantity, bounds=c.quantity.bounds.shrunk(by * c.quantity.bounds.width)))
        for c in problem.constraints
    ]
    return replace(problem, constraints=tuple(drawn))


@pytest.mark.parametrize("name", ["tight_2", "tight_4"])
def test_hyperparameters_are_kept_where_bounds_hardly_change_and_learned_again_where_they_do(name):
    first = jointly(name)
    nearly, tighter = (continued(first, with_less_room(problem_of(name), by)) for by in (1e-5, 0.05))
    assert nearly.posterior.prior == first.posterior.prior
    assert nearly.objective <= first.objective + 2 * first.allowed_gap
    assert tighter.posterior.prior != first.posterior.prior


@pytest.mark.parametrize("sought", [None, (0.01, 0.06)])
@pytest.mark.parametrize("name", ["tight_2", "wild_0"])
def test_no_length_scale_below_two_steps_is_sought_for_bounds_at_all_times(name, sought):
    """Unless its interval is given, or bounds hold at steps only: between these, signals may do what no input can."""
    case = problem_of(name)
    (part,) = case.prior.parts
    prior = JointPrior((replace(part, kernel=SquaredExponential(lengthscale=sought)),))
    step = INSTANCES[name].plant.sampling_time
    given = Interval(*sought) if sought else case.space.bounds["lengthscale"]
    at_steps = replace(case, prior=prior, space=SearchSpace({**case.space.bounds, "lengthscale": given}))
    at_all_times = replace(
        at_steps, constraints=tuple(replace(c, index_set=RealTimes(Window(0.0, 2.0))) for c in case.constraints)
    )
    assert keep_off_short_times(at_steps) == at_steps
    least = keep_off_short_times(at_all_times).space.bounds["lengthscale"]
    assert least == (given if sought else Interval(2 * step, given.upper))
