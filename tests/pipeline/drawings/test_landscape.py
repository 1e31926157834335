"""The landscape says at each grid point what the problem itself says."""

import numpy as np
import pytest

from pipeline.drawings.landscape import landscape
from pipeline.published.scalar import scalar, state_and_input
from trackably.gp.hyperparameter import Learned
from trackably.gp.joint import JointPrior
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.learning.constraint import Constraint
from trackably.learning.index_set import Steps
from trackably.learning.problem import ConstrainedProblem
from trackably.learning.space import SearchSpace
from trackably.systems.polytopes import Interval

PLANT = scalar(0.9, 0.5, state_set=Interval(-2, 0.05), input_set=Interval(-0.5, 0.5), sampling_time=0.01)
STATE, INPUT = state_and_input(PLANT)
SAMPLES = Samples(np.arange(7) / 10, np.array([-1.0, -0.4, -0.05, 0.0, 0.0, 0.0, 0.0]))
CONSTRAINTS = (Constraint(STATE, Steps(0, 130, 0.01)), Constraint(INPUT, Steps(0, 129, 0.01)))


def problem(noise_std: float = 0.01) -> ConstrainedProblem:
    prior = JointPrior((Prior(SquaredExponential(0.7, 0.22).as_learned(), noise_std),))
    return ConstrainedProblem((SAMPLES,), prior, SearchSpace.around((SAMPLES,), prior), CONSTRAINTS)


def test_each_point_agrees_with_the_problem() -> None:
    theta1, theta2 = np.array([0.5, 0.7, 1.1]), np.array([0.15, 0.22])
    grid = landscape(problem(), theta1, theta2)
    k = np.arange(131) * 0.01
    for i, second in enumerate(theta2):
        for j, first in enumerate(theta1):
            posterior = problem().posterior(np.log([first, second]))
            margins = [np.min(c.relative_margin(posterior, k[: 131 - n])) for n, c in enumerate(CONSTRAINTS)]
            assert grid.objective[i, j] == posterior.negative_log_marginal_likelihood()[0]
            assert grid.margin[i, j] == pytest.approx(min(margins), abs=1e-14)


def test_what_cannot_be_factored_is_not_a_number() -> None:
    grid = landscape(problem(noise_std=1e-12), np.array([1.0]), np.array([0.1, 1e4]))
    assert np.isfinite(grid.objective[0, 0])
    assert np.isnan(grid.objective[1, 0])
    assert np.isnan(grid.margin[1, 0])


def test_two_hyperparameters_are_needed() -> None:
    with pytest.raises(ValueError, match="two learned hyperparameters, got signal_std, lengthscale, noise_std"):
        landscape(problem(Learned(0.01)), np.ones(1), np.ones(1))
