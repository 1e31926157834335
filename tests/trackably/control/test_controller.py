"""One step of the controller: its optimum against a naive second implementation, and its explanation if infeasible."""

import numpy as np
import pytest

from tests.trackably.control import instances, naive
from trackably.control.controller import TOLERANCE, Controller
from trackably.control.stepping import Infeasible, Plan
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope

PLANT = instances.double_integrator()
CONTROLLER = instances.controller_of(PLANT)


@pytest.mark.parametrize("seed", range(9))
def test_the_optimum_of_random_systems_is_that_of_the_naive_program(seed):
    case = instances.instance(seed)
    result = case.controller.step(0, case.start, case.reference)
    cost, applied = naive.optimum(case.controller, 0, case.start, case.reference, TOLERANCE)
    assert isinstance(result, Plan)
    assert result.cost == pytest.approx(cost, rel=1e-4)
    np.testing.assert_allclose(result.input, applied, atol=1e-3 * max(1, np.max(np.abs(applied))))


ON_THE_BOUND, BEYOND = instances.at_rest(PLANT, 1.2), instances.at_rest(PLANT, 1.4)
UNREACHED = [
    *((ON_THE_BOUND, state) for state in ((1.2, 0.3), (1.1, 1.5), (-1.0, -2.0), (0.0, 0.0), (5.0, 0.0))),
    *((BEYOND, state) for state in ((1.0, 0.0), (1.2, 0.0), (0.9, -1.0), (-0.5, 0.0), (1.0, 0.5))),
]


@pytest.mark.parametrize(("reference", "state"), UNREACHED)
def test_infeasibility_is_explained_by_the_least_widening_and_the_closest_end(reference, state):
    """Of the plans with this end, the first input of the cheapest is offered."""
    result, state = CONTROLLER.step(7, state, reference), np.array(state)
    assert isinstance(result, Infeasible)
    enough, too_little = (result.widening * (1 + by) for by in (1e-2, -1e-2))
    assert naive.optimum(CONTROLLER, 7, state, reference, enough)[0] < np.inf
    assert naive.optimum(CONTROLLER, 7, state, reference, too_little)[0] == np.inf
    miss, offered = naive.closest_end(CONTROLLER, 7, state, reference)
    if result.terminal_error is None:
        assert miss == np.inf
    else:
        assert np.linalg.norm(result.terminal_error / [2.2, 4]) == pytest.approx(miss, rel=1e-3, abs=1e-5)
        np.testing.assert_allclose(result.fallback, offered, atol=1e-2)
    width = next(q.bounds.width for q in PLANT.quantities if q.name == result.quantity)
    assert result.excess == pytest.approx(result.widening * width)
    assert 7 <= result.at_step <= 27
    assert PLANT.input_set.margin(result.fallback) >= 0


def test_weights_that_are_left_out_count_errors_in_the_widths_of_the_sets():
    plant = ConstrainedSystem(
        LinearSystem([[1.0, 0.1], [0.0, 1.0]], [[0.0], [0.1]], sampling_time=0.1),
        Polytope.box([-1.0, -np.inf], [3.0, np.inf]),
        Polytope.box([-5.0], [5.0]),
    )
    controller = Controller(plant, 10)
    np.testing.assert_allclose(controller.Q, np.diag([1 / 16, 1.0]))
    np.testing.assert_allclose(controller.R, [[1 / 100]])
    assert np.array_equal(Controller(plant, 10, R=[[2.0]]).Q, controller.Q)
