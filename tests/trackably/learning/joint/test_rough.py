"""Rough kernels beside active bounds: what is handed to the proof keeps its bounds beside kinks too."""

import numpy as np

from trackably.certificates.certified import Certified, learn_certified
from trackably.certificates.goal import goal_for
from trackably.checker.certificate import Window
from trackably.gp.joint import JointPrior
from trackably.gp.kernels.matern import Matern32
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.learning.learner import FUNCTION
from trackably.learning.space import SearchSpace
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope


def test_a_drive_that_stops_and_goes_is_proved():
    """Where a speed of zero or an acceleration is reached, a kink is a sample, or a sample less a step."""
    rng, times, turns = np.random.default_rng(5), np.arange(80.0), np.arange(0.0, 90.0, 8.0)
    speeds = np.interp(times, turns, np.maximum(0.0, rng.uniform(-3.0, 12.0, len(turns))))
    samples = (Samples(times, speeds + 0.04 * rng.standard_normal(len(times))),)
    prior = JointPrior((Prior(Matern32(7.0, 20.0), 0.04, 8.0),))
    system = LinearSystem.scalar(1.0, 0.2, sampling_time=0.2)
    plant = ConstrainedSystem(system, Polytope.box([-0.05], [26.0]), Polytope.box([-1.5], [1.5]))
    goal = goal_for(Window(0.0, 79.0), samples, prior, plant)
    space, attempts = SearchSpace.around(samples, prior, 1), []
    found = learn_certified(samples, prior, plant, space, goal, learner=FUNCTION, on_attempt=attempts.append)
    assert isinstance(found, Certified)
    assert len(attempts) == 1
    assert len(found.solution.active_bounds) > 20
