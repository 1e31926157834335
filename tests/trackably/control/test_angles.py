"""A robot in the plane: fewer inputs than states, a speed above zero, and a heading that counts up to whole turns."""

import numpy as np
import pytest

from tests.trackably.systems.forms.instances import T_S, robot
from trackably.control.controller import Controller
from trackably.control.references import TabulatedReference
from trackably.control.simulation import simulate
from trackably.control.stepping import Plan, Status
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Window

ROBOT = ConstrainedSystem(
    robot(),
    Polytope.box([-3.0, -3.0, -np.inf], [3.0, 3.0, np.inf]),
    Polytope.box([0.4, -1.2], [1.1, 1.2]),
)
CONTROLLER = Controller(ROBOT, 20, np.diag([1.0, 1.0, 0.5]), np.diag([0.5, 0.5]))


def circle(steps: int) -> TabulatedReference:
    """Return rounds of 1.2 m at 0.72 m/s; the heading is in (−π, π], so that it jumps."""
    t = np.arange(steps + 2) * T_S
    path = 1.2 * np.stack([np.cos(0.6 * t), np.sin(0.6 * t)], axis=1)
    moved = np.diff(path, axis=0)
    heading = np.arctan2(moved[:, 1], moved[:, 0])
    turn_rate = np.diff(np.unwrap(heading)) / T_S
    states = np.column_stack([path[:-1], heading])
    inputs = np.column_stack([np.linalg.norm(moved, axis=1)[:-1] / T_S, turn_rate])
    return TabulatedReference(0, Window(states, inputs))


def test_a_loop_from_ahead_on_the_path_waits_for_it_as_slowly_as_it_may():
    reference = circle(150)
    state = reference.window(0, 1).states[0] + [-0.1, 0.3, -0.4]
    loop = simulate(CONTROLLER, reference, state, 80)
    assert not loop.without_plan
    assert np.max(np.abs(loop.errors[-1])) < 1e-4
    assert np.max(loop.cost_increases) <= 1e-9 * loop.costs[0]
    assert np.min(ROBOT.input_set.margin(loop.inputs)) >= 0
    assert np.min(loop.inputs[:, 0]) == pytest.approx(0.4, abs=1e-6)


@pytest.mark.parametrize("turns", [-3, 1])
def test_whole_turns_make_no_difference(turns):
    reference = circle(60)
    state = reference.window(20, 1).states[0] + [0.1, -0.1, 0.2]
    here = CONTROLLER.step(20, state, reference)
    turned = CONTROLLER.step(20, state + np.array([0.0, 0.0, 2 * np.pi * turns]), reference)
    assert turned.cost == pytest.approx(here.cost, rel=1e-7)
    np.testing.assert_allclose(turned.input, here.input, atol=1e-5)
    np.testing.assert_allclose(turned.states[:, 2] - 2 * np.pi * turns, here.states[:, 2], atol=1e-5)


@pytest.mark.parametrize("heading", [0.0, 0.3, np.pi / 2])
def test_a_robot_returns_along_its_heading_to_where_it_stands(heading):
    """At rest it cannot move sideways, so that conditions of the linearisation depend on each other."""
    plant = ConstrainedSystem(ROBOT.system, ROBOT.state_set, Polytope.box([-1.1, -1.2], [1.1, 1.2]))
    controller = Controller(plant, 10, CONTROLLER.Q, CONTROLLER.R)
    place = np.array([0.0, 0.0, heading])
    reference = TabulatedReference(0, Window(np.tile(place, (13, 1)), np.zeros((12, 2))))
    ahead = np.array([np.cos(heading), np.sin(heading), 0.0])
    for distance in (0.0, 0.1):
        plan = controller.step(0, place + distance * ahead, reference)
        assert isinstance(plan, Plan)
        assert plan.status is Status.NO_ACTIVE_BOUND
        assert plan.cost == pytest.approx(8.48156 * distance**2, rel=1e-6)
        assert plan.terminal_residual < 1e-12
