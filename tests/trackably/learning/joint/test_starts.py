"""A robot that must not stand still turns left or right: which way is better shows only where both are tried."""

from functools import cache

import numpy as np
import pytest

from trackably.checker.certificate import Window
from trackably.gp.joint import JointPrior
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.learning.constraint import Constraint
from trackably.learning.index_set import RealTimes
from trackably.learning.joint import search
from trackably.learning.joint.search import JointSearch, learn_from
from trackably.learning.joint.sequential import keep_off_singularities, tightening, with_backoff
from trackably.learning.problem import ConstrainedProblem
from trackably.learning.space import SearchSpace
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.library import mobile_robot
from trackably.systems.polytopes import Polytope

TIMES = np.arange(0.0, 4.01, 0.25)
NO_THETA = np.empty(0)


@cache
def there_and_back() -> ConstrainedProblem:
    """A robot goes a metre and comes back; samples lie to its left at first, then to its right."""
    values = np.clip(np.minimum(TIMES, 4.0 - TIMES), 0.0, 1.8) / 2.0, 0.05 * (2.0 - TIMES)
    prior = JointPrior(tuple(Prior(SquaredExponential(0.7, 1.0), 0.05) for _ in "xy"), ("x", "y"))
    inside = Polytope.box([-2.0, -1.0, -np.inf], [2.0, 1.0, np.inf])
    plant = ConstrainedSystem(mobile_robot(0.1), inside, Polytope.box([0.1, -8.0], [1.5, 8.0]))
    constraints = tuple(Constraint(quantity, RealTimes(Window(0.0, 4.0)), 1e-6) for quantity in plant.quantities)
    samples = tuple(Samples(TIMES, of) for of in values)
    return ConstrainedProblem(samples, prior, SearchSpace({}), constraints)


def to(side: float):
    """Signals that turn on one side."""
    x, y = there_and_back().posterior(NO_THETA).signals
    return [x, lambda t: y(t) + side * 0.5 * (2.0 - t) * np.exp(-(((t - 2.0) / 0.7) ** 2))]


def test_the_best_of_all_starts_is_taken_and_their_spread_is_the_range_of_what_they_lead_to(monkeypatch):
    left, right = to(1.0), to(-1.0)

    def begun(*starts):
        monkeypatch.setattr(search, "starts_for", lambda *_: starts)
        found = JointSearch(there_and_back())
        return found.begin(NO_THETA).objective, found.spread

    alone = [begun(start)[0] for start in (left, right)]
    assert max(alone) - min(alone) > 0.1
    for starts in ([left, right], [right, left]):
        assert begun(*starts) == pytest.approx((min(alone), max(alone) - min(alone)), abs=1e-3)


def stopping() -> ConstrainedProblem:
    """Samples of a robot that stands at first and at last, as it may now, and drives faster in between than it may."""
    draws, times = np.random.default_rng(0), np.arange(0.0, 8.01, 0.2)
    part = np.clip((times - 0.5) / 7, 0.0, 1.0)
    way = 10 * part**3 - 15 * part**4 + 6 * part**5
    paths = 4 * way, 0.5 * np.sin(1.5 * np.pi * way)
    samples = tuple(Samples(times, path + 0.02 * draws.standard_normal(len(times))) for path in paths)
    prior = JointPrior(tuple(Prior(SquaredExponential(), 0.02, np.mean(of.values)) for of in samples), ("x", "y"))
    inside = Polytope.box([-1.0, -0.4, -np.inf], [5.0, 0.4, np.inf])
    plant = ConstrainedSystem(mobile_robot(0.1), inside, Polytope.box([0.0, -1.5], [0.9, 1.5]))
    constraints = tuple(Constraint(quantity, RealTimes(Window(0.0, 8.0)), 1e-6) for quantity in plant.quantities)
    return ConstrainedProblem(samples, prior, SearchSpace.around(samples, prior), constraints)


def test_a_robot_that_may_stand_still_is_kept_off_the_point_where_its_speed_has_no_slope():
    """Bounded at places up to this point, functions jump between local minima, and the best one found costs 1,620."""
    likeliest = np.log([1.696, 2.971, 0.335, 1.426])
    found = learn_from([likeliest], stopping(), steps=0)
    assert found.objective < 1100
    assert found.backoff == pytest.approx(0.05, rel=1e-9)


@pytest.mark.parametrize("problem", [there_and_back(), keep_off_singularities(stopping())])
def test_bounds_are_as_much_tighter_as_they_were_tightened(problem):
    assert tightening(problem, problem) == 0.0
    assert tightening(with_backoff(problem, 0.03), problem) == pytest.approx(0.03 - 1e-6, rel=1e-9)
