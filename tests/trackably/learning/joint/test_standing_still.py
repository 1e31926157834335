"""A robot that stops and turns: its speed has no slope where it stands."""

import numpy as np

from trackably.checker.certificate import Window
from trackably.gp.joint import JointPrior
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.learning.constraint import Constraint
from trackably.learning.index_set import RealTimes
from trackably.learning.joint.search import learn_from
from trackably.learning.problem import ConstrainedProblem
from trackably.learning.space import SearchSpace
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.library import mobile_robot
from trackably.systems.polytopes import Polytope


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
    assert learn_from([likeliest], stopping(), steps=0).objective < 1100
