"""∂J/∂ln θ by the envelope theorem, against central differences of J with the same places."""

import numpy as np
import pytest

from tests.trackably.gp import naive
from tests.trackably.gp.instances import over
from tests.trackably.learning.joint.instances import ALL, Case, solved
from trackably.learning.joint.constrained_mean import constrained_mean
from trackably.learning.joint.places import Places
from trackably.learning.joint.search import JointProgram

_RELATIVE = 2e-6


def program(case: Case, places: Places) -> JointProgram:
    return JointProgram(case.problem, places, case.posterior.signals)


def assert_is_the_slope(case: Case, places: Places) -> None:
    joint = program(case, places)
    found = joint.evaluate(case.prior.log_hyperparameters)
    slopes = naive.by_log_hyperparameters(lambda at: joint.evaluate(at.log_hyperparameters).value, case.prior)
    scale = np.max(np.abs(slopes))
    np.testing.assert_allclose(found.gradient, slopes, atol=_RELATIVE * scale)


@pytest.mark.parametrize("name", ALL)
def test_is_the_slope(name):
    assert_is_the_slope(ALL[name], solved(name).places)


@over(ALL, "case")
def test_the_value_is_likelihood_and_price(case):
    places = tuple(np.column_stack([case.times[::13], np.ones(len(case.times[::13]))]) for _ in case.plant.quantities)
    found = program(case, places).evaluate(case.prior.log_hyperparameters)
    price = constrained_mean(case.problem, case.posterior, places).price
    likelihood, _ = case.posterior.negative_log_marginal_likelihood()
    assert found.value == pytest.approx(likelihood + price, rel=1e-12)
    assert price >= 0 or case.required
