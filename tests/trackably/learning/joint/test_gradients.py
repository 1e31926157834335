"""∂J/∂ln θ by the envelope theorem, and slopes of l and of bounds of the mean, against central differences."""

from dataclasses import replace

import numpy as np
import pytest

from tests.trackably.gp import naive
from tests.trackably.gp.instances import over
from tests.trackably.learning.joint.instances import ALL, Case, solved
from trackably.learning.joint.constrained_mean import constrained_mean
from trackably.learning.joint.places import Places
from trackably.learning.joint.search import JointProgram
from trackably.learning.nonlinear import Program


def program(case: Case, places: Places) -> JointProgram:
    return JointProgram(case.problem, places, case.posterior.signals)


@pytest.mark.parametrize("name", ALL)
def test_is_the_slope(name):
    case, joint = ALL[name], program(ALL[name], solved(name).places)
    found = joint.evaluate(case.prior.log_hyperparameters)
    slopes = naive.by_log_hyperparameters(lambda at: joint.evaluate(at.log_hyperparameters).value, case.prior)
    np.testing.assert_allclose(found.gradient, slopes, atol=2e-6 * np.max(np.abs(slopes)))


@over(ALL, "case")
def test_the_value_is_likelihood_and_price(case):
    times = case.times[::13]
    places = (np.column_stack([times, np.ones(len(times))]),) * len(case.plant.quantities)
    found = program(case, places).evaluate(case.prior.log_hyperparameters)
    price = constrained_mean(case.problem, case.posterior, places).price
    likelihood, _ = case.posterior.negative_log_marginal_likelihood()
    assert found.value == pytest.approx(likelihood + price, rel=1e-12)
    assert price >= 0 or case.required


@pytest.mark.parametrize("name", ["drifts", "axis", "plane", "mixed", "one_lengthscale_for_both"])
def test_slopes_of_bounds_of_the_posterior_mean(name):
    """Rows that look at both signals, and at one; hyperparameters of their own, and shared ones."""
    case = ALL[name]
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
