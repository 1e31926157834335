"""A robot in the plane: fewer inputs than states, and a heading that counts up to whole turns."""

from dataclasses import replace

import numpy as np
import pytest

from tests.trackably.control.instances import robot_beside_its_path
from trackably.control.controller import Controller
from trackably.control.references import TabulatedReference
from trackably.control.simulation import simulate
from trackably.control.stepping import Plan, Status
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Window

CASE = robot_beside_its_path()


@pytest.mark.parametrize("turns", [-3, 1])
def test_whole_turns_make_no_difference(turns):
    state = CASE.reference.window(20, 1).states[0] + [0.1, -0.1, 0.2]
    here, turned = (
        CASE.controller.step(20, state + np.array([0.0, 0.0, 2 * np.pi * n]), CASE.reference) for n in (0, turns)
    )
    assert turned.cost == pytest.approx(here.cost, rel=1e-7)
    np.testing.assert_allclose(turned.input, here.input, atol=1e-5)
    np.testing.assert_allclose(turned.states - [0.0, 0.0, 2 * np.pi * turns], here.states, atol=1e-5)


def test_errors_have_no_whole_turns_where_a_heading_is_counted_from_zero_again():
    def modulo(k, x, u):
        *place, heading = CASE.controller.plant.system.successor(x, u)
        return [*place, heading % (2 * np.pi)]

    loop = simulate(CASE.controller, CASE.reference, CASE.start, 20, successor=modulo)
    assert np.ptp(loop.states[:, 2]) > 6
    assert np.max(np.abs(loop.errors[:, 2])) < 1


@pytest.mark.parametrize("heading", [0.0, 0.3, np.pi / 2])
def test_a_robot_returns_along_its_heading_to_where_it_stands(heading):
    """At rest it cannot move sideways, so that conditions of the linearisation depend on each other."""
    plant = replace(CASE.controller.plant, input_set=Polytope.box([-1.1, -1.2], [1.1, 1.2]))
    controller = Controller(plant, 10, CASE.controller.Q, CASE.controller.R)
    place = np.array([0.0, 0.0, heading])
    reference = TabulatedReference(0, Window(np.tile(place, (13, 1)), np.zeros((12, 2))))
    ahead = np.array([np.cos(heading), np.sin(heading), 0.0])
    for distance in (0.0, 0.1):
        plan = controller.step(0, place + distance * ahead, reference)
        assert isinstance(plan, Plan)
        assert plan.status is Status.NO_ACTIVE_BOUND
        assert plan.cost == pytest.approx(8.48156 * distance**2, rel=1e-6)
        assert plan.terminal_residual < 1e-12
