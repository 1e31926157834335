"""The feasible set: the controller itself decides whether states near the corners are feasible."""

import numpy as np
import pytest

from pipeline.loops.feasible_set import feasible_set
from tests.trackably.certificates.references import certified, unconstrained
from tests.trackably.control import instances
from trackably.control.controller import Controller
from trackably.control.stepping import Plan

PLANT = instances.double_integrator()
REFERENCES = {
    "at rest": lambda: instances.at_rest(PLANT),
    "on a bound": lambda: instances.at_rest(PLANT, 1.2),
    "example1": lambda: certified("example1").reference,
    "example2": lambda: certified("example2").reference,
}


@pytest.mark.parametrize(
    ("name", "horizon"), [("at rest", 2), ("at rest", 6), ("on a bound", 6), ("example1", 2), ("example2", 6)]
)
def test_corners_are_where_feasibility_ends(name, horizon):
    """Those of polygons and the middles of their sides, and the ends of intervals, of scalar systems."""
    reference = REFERENCES[name]()
    states = reference.plant.state_set
    controller = Controller(reference.plant, horizon, np.eye(states.dimension), np.eye(1))
    corners = feasible_set(controller, reference, 30)
    centre = corners.mean(axis=0)
    for p, q in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        for place in (p, (p + q) / 2)[: states.dimension]:
            inside, outside = (centre + part * (place - centre) for part in (0.999, 1.001))
            assert isinstance(controller.step(30, inside, reference), Plan)
            # The state set bounds the feasible set too, but the controller does not constrain the current state.
            assert states.margin(outside) < 0 or not isinstance(controller.step(30, outside, reference), Plan)


def test_it_is_empty_where_the_reference_leaves_the_state_set():
    reference = unconstrained("example1")
    plant = reference.plant
    leaves = instances.first_outside(reference, plant.state_set, reference.state)
    controller = Controller(plant, 20, np.eye(1), np.eye(1))
    assert feasible_set(controller, reference, leaves - 20).shape == (0, 1)
    assert feasible_set(controller, reference, leaves - 21).shape == (2, 1)
