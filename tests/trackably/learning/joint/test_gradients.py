"""∂J/∂ln θ by the envelope theorem, and slopes of l and of bounds of the mean, against central differences."""

from dataclasses import replace

import numpy as np
import pytest

from tests.trackably.gp import naive
from tests.trackably.gp.instances import over
from tests.trackably.learning.joint.instances import ALL, Case, solved
from tests.trackably.systems.nonlinear_instances import INSTANCES
from trackably.gp.joint import JointPrior
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.learning.index_set import Steps
from trackably.learning.joint.search import JointProgram
from trackably.learning.nonlinear import Program


@pytest.mark.parametrize("name", ALL)
def test_is_the_slope(name):
    case = ALL[name]
    places = solved(name).places
    joint = JointProgram(case.problem, places, case.posterior.signals, places)
    found = joint.evaluate(case.prior.log_hyperparameters)
    slopes = naive.by_log_hyperparameters(lambda at: joint.evaluate(at.log_hyperparameters).value, case.prior)
    np.testing.assert_allclose(found.gradient, slopes, atol=2e-6 * np.max(np.abs(slopes)))


def nonlinear(name: str) -> Case:
    plant, rng = INSTANCES[name].plant, np.random.default_rng(2)
    samples = tuple(Samples(np.linspace(0, 2, 8), 0.7 + 0.1 * rng.standard_normal(8)) for _ in plant.system.states)
    parts = tuple(Prior(SquaredExponential(0.3, 0.6), 0.1, 0.7).as_learned() for _ in samples)
    return Case(samples, JointPrior(parts, plant.system.states), plant, Steps(2, 36, 0.05))


SEVERAL = {name: ALL[name] for name in ("drifts", "axis", "plane", "mixed", "one_lengthscale_for_both")}
SEVERAL |= {name: nonlinear(name) for name in ("tank", "reactor", "vehicle")}


@over(SEVERAL, "case")
def test_slopes_of_bounds_of_the_posterior_mean(case):
    """Rows that look at both signals, and at one; hyperparameters of their own, and shared ones; formulas."""
    problem, times = case.problem, tuple(case.times[k :: 20 + k] for k, _ in enumerate(case.plant.quantities))
    problem = replace(problem, constraints=tuple(replace(c, backoff=0.01) for c in problem.constraints))
    nonlinear = Program(problem, times)
    at = nonlinear.evaluate(case.prior.log_hyperparameters)
    slopes = naive.by_log_hyperparameters(lambda to: nonlinear.evaluate(to.log_hyperparameters).slack, case.prior).T
    np.testing.assert_allclose(at.jacobian, slopes, rtol=1e-5, atol=1e-5 * (1 + np.max(np.abs(slopes))))
    slope = naive.by_log_hyperparameters(lambda to: nonlinear.evaluate(to.log_hyperparameters).value, case.prior)
    np.testing.assert_allclose(at.gradient, slope, rtol=1e-5, atol=1e-5)
    margins = []
    for quantity, t in zip(case.plant.quantities, times, strict=True):
        values, bounds = quantity(case.posterior.signals, t), quantity.bounds
        margins += [(values - bounds.lower) / bounds.width, (bounds.upper - values) / bounds.width]
    np.testing.assert_allclose(at.slack, np.concatenate(margins) - 0.01, atol=1e-12)
