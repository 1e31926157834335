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
from trackably.learning.joint.search import JointSearch
from trackably.learning.joint.sequential import tightening, with_backoff
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
    return ConstrainedProblem(tuple(Samples(TIMES, of) for of in values), prior, SearchSpace({}), constraints)


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

    (better, _), (worse, _) = begun(left), begun(right)
    assert worse - better > 0.1
    assert begun(right, left, right) == pytest.approx((better, worse - better), abs=1e-3)


def test_bounds_are_as_much_tighter_as_they_were_tightened():
    problem = there_and_back()
    assert tightening(problem, problem) == 0.0
    assert tightening(with_backoff(problem, 0.03), problem) == pytest.approx(0.03 - 1e-6, rel=1e-9)


def test_bounds_are_widened_further_after_a_step_without_a_function(monkeypatch):
    """Otherwise they stay as tight as at first, and the function is far from its samples: J is larger by 7."""
    find, every = JointSearch._distinct, JointSearch(there_and_back()).begin(NO_THETA)
    monkeypatch.setattr(JointSearch, "_distinct", lambda *of: [] if of[-1] == 0.03 else find(*of))
    assert JointSearch(there_and_back()).begin(NO_THETA).objective == pytest.approx(every.objective, abs=0.1)


def test_if_nothing_can_be_computed_the_first_and_the_last_bounds_are_tried_and_no_other_start(monkeypatch):
    tried = []
    monkeypatch.setattr(search, "exchange_bounds", lambda problem, *_: tried.append(problem.constraints[0].backoff))
    search.learn_jointly(there_and_back(), also=[NO_THETA])
    assert tried == 2 * (3 * [0.1] + 3 * [1e-6])
