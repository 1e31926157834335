"""What is applied where no plan ends on the reference: the end comes first, then the cost of the way there."""

import numpy as np
import pytest

from tests.trackably.certificates.references import certified
from tests.trackably.control import instances, naive
from trackably.control.controller import TOLERANCE, Controller
from trackably.control.problem import StepProblem
from trackably.control.references import TabulatedReference
from trackably.control.simulation import apply_fallback, simulate
from trackably.control.stepping import Infeasible
from trackably.systems.reference import Window

PLANT = instances.double_integrator()
CONTROLLER = instances.controller_of(PLANT)
BEYOND = instances.at_rest(PLANT, 1.4)  # 0.2 outside


@pytest.mark.parametrize("state", [(1.0, 0.0), (1.2, 0.0), (0.9, -1.0), (-0.5, 0.0), (1.0, 0.5)], ids=str)
def test_among_the_plans_with_the_closest_end_the_cheapest_is_taken(state):
    state = np.array(state)
    miss, cost = naive.closest_end(CONTROLLER, 0, state, BEYOND)
    closest = StepProblem.of(CONTROLLER.formulation, 0, state, BEYOND.window(0, CONTROLLER.horizon)).closest
    assert np.linalg.norm((closest.states[-1] - [1.4, 0]) / [2.2, 4]) == pytest.approx(miss, rel=1e-5)
    assert closest.cost == pytest.approx(cost, rel=2e-3)
    assert closest.slack >= -3 * TOLERANCE
    applied = CONTROLLER.step(0, state, BEYOND)
    assert isinstance(applied, Infeasible)
    assert np.array_equal(applied.fallback, closest.input)


def test_a_reference_that_leaves_for_good_is_followed_along_the_bound():
    plant = certified("example1").reference.plant
    x = np.linspace(-0.1, 0.3, 63)[:, None]
    reference = TabulatedReference(0, Window(x, (x[1:] - 0.9 * x[:-1]) / 0.5))
    controller = Controller(plant, 10, np.eye(1), np.eye(1))
    loop = simulate(controller, reference, x[0], 50, on_infeasible=apply_fallback)
    np.testing.assert_allclose(loop.states[-10:], 0.05, atol=1e-6)
    np.testing.assert_allclose(np.minimum(x[:51], 0.05), loop.states, atol=0.03)
