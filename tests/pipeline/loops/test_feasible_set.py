"""The feasible set: the controller itself decides whether states near the corners are feasible."""

import numpy as np
import pytest

from pipeline.loops.feasible_set import feasible_set
from tests.trackably.certificates.references import certified, unconstrained
from tests.trackably.control import instances
from trackably.control.controller import Controller
from trackably.control.stepping import Plan

PLANT = instances.double_integrator()


def is_feasible(controller, reference, k, state) -> bool:
    return isinstance(controller.step(k, state, reference), Plan)


@pytest.mark.parametrize("level", [0.0, 1.2])
@pytest.mark.parametrize("horizon", [2, 6])
def test_corners_are_where_feasibility_ends(horizon, level):
    controller, still = Controller(PLANT, horizon, np.eye(2), np.eye(1)), instances.at_rest(PLANT, level)
    corners = feasible_set(controller, still, 0)
    centre = corners.mean(axis=0)
    for p, q in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        for place in (p, (p + q) / 2):
            assert is_feasible(controller, still, 0, centre + 0.999 * (place - centre))
            outside = centre + 1.001 * (place - centre)
            # The state set bounds the feasible set too, but the controller does not constrain the current state.
            assert PLANT.state_set.margin(outside) < 0 or not is_feasible(controller, still, 0, outside)


@pytest.mark.parametrize("example", ["example1", "example2"])
def test_of_a_scalar_system_it_is_an_interval_around_the_reference(example):
    reference = certified(example).reference
    plant = reference.plant
    previous = np.array([np.inf, -np.inf])
    for horizon in (1, 6):
        controller = Controller(plant, horizon, np.eye(1), np.eye(1))
        ends = feasible_set(controller, reference, 30)
        assert ends.shape == (2, 1)
        assert ends[0, 0] <= min(previous[0], reference.state(30)[0] + 1e-9)
        assert ends[1, 0] >= max(previous[1], reference.state(30)[0] - 1e-9)
        for end, outwards in zip(ends, (-1e-4, 1e-4), strict=True):
            assert is_feasible(controller, reference, 30, end - outwards)
            outside = end + outwards
            assert plant.state_set.margin(outside) < 0 or not is_feasible(controller, reference, 30, outside)
        previous = ends[:, 0]


def test_it_is_empty_where_the_reference_leaves_the_state_set():
    reference = unconstrained("example1")
    plant = reference.plant
    leaves = instances.first_outside(reference, plant.state_set, reference.state)
    controller = Controller(plant, 20, np.eye(1), np.eye(1))
    assert feasible_set(controller, reference, leaves - 20).shape == (0, 1)
    assert feasible_set(controller, reference, leaves - 21).shape == (2, 1)
