"""One step of the controller: its optimum against a naive second implementation, and its explanation if infeasible."""

import numpy as np
import pytest

from tests.trackably.checker.redundant import PLANE, in_the_plane
from tests.trackably.control import instances, naive
from trackably.control.controller import TOLERANCE, Controller
from trackably.control.stepping import Infeasible, Plan, Status
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope

PLANT = instances.double_integrator()
AT_REST = instances.at_rest(PLANT, 1.2)  # on its bound
CONTROLLER = Controller(PLANT, 20, np.diag([10.0, 1.0]), 0.1 * np.eye(1))


@pytest.mark.parametrize("seed", range(0, 50, 6))
def test_the_optimum_of_random_systems_is_that_of_the_naive_program(seed):
    case = instances.instance(seed)
    result = case.controller.step(0, case.start, case.reference)
    cost, applied = naive.optimum(case.controller, 0, case.start, case.reference, TOLERANCE)
    assert isinstance(result, Plan)
    assert result.cost == pytest.approx(cost, rel=1e-4)
    np.testing.assert_allclose(result.input, applied, atol=1e-3 * max(1, np.max(np.abs(applied))))


@pytest.mark.parametrize("state", [(1.2, 0.3), (1.1, 1.5), (-1.0, -2.0), (0.0, 0.0), (5.0, 0.0)], ids=str)
def test_infeasibility_is_explained_by_the_least_widening(state):
    state = np.array(state)
    result = CONTROLLER.step(7, state, AT_REST)
    assert isinstance(result, Infeasible)
    enough, too_little = (result.widening * (1 + by) for by in (1e-2, -1e-2))
    assert naive.optimum(CONTROLLER, 7, state, AT_REST, enough)[0] < np.inf
    assert naive.optimum(CONTROLLER, 7, state, AT_REST, too_little)[0] == np.inf
    miss = naive.smallest_miss(CONTROLLER, 7, state, AT_REST)
    if result.terminal_error is None:
        assert miss == np.inf
    else:
        assert np.linalg.norm(result.terminal_error / [2.2, 4]) == pytest.approx(miss, rel=1e-3, abs=1e-5)
    width = next(q.bounds.width for q in PLANT.quantities if q.name == result.quantity)
    assert result.excess == pytest.approx(result.widening * width)
    assert 7 <= result.at_step <= 27
    assert PLANT.input_set.margin(result.fallback) >= 0
    assert result.quantity in result.explanation


def test_the_inputs_applied_are_admissible_in_a_polytope_that_is_no_box():
    system = LinearSystem(np.array([[1.0, 0.2], [0.0, 1.0]]), np.array([[1.0, 0.3], [0.2, 1.0]]), sampling_time=0.1)
    U = Polytope.halfspaces(np.array([[1.0, 1.0], [-1.0, 0.0], [0.0, -1.0]]), np.array([0.1, 0.1, 0.1]))
    plant = ConstrainedSystem(system, Polytope.box([-9.0, -9.0], [9.0, 9.0]), U)
    controller, still = Controller(plant, 10, np.eye(2), np.eye(2)), instances.at_rest(plant)
    state, statuses = np.array([0.6, -0.5]), []
    for k in range(15):
        result = controller.step(k, state, still)
        assert isinstance(result, Plan)
        assert U.margin(result.input) >= 0
        statuses.append(result.status)
        state = system.successor(state, result.input)
    assert {Status.SOLVED, Status.NO_ACTIVE_BOUND} <= set(statuses)
    assert np.max(np.abs(state)) < 1e-2


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


def test_with_redundant_inputs_every_step_is_feasible_and_admissible():
    """The reference's inputs are the smallest admissible ones, which differ from the smallest ones."""
    plant, reference = PLANE, in_the_plane().reference
    controller = Controller(plant, 20, np.eye(4), 0.1 * np.eye(4))
    x, costs = reference.state(0) + 0.02, []
    for k in range(200):
        result = controller.step(k, x, reference)
        assert isinstance(result, Plan)
        assert plant.input_set.margin(result.input) >= 0
        costs.append(result.cost)
        x = plant.system.successor(x, result.input)
    assert np.max(np.diff(costs)) < 1e-9
    np.testing.assert_allclose(x, reference.state(200), atol=1e-9)
