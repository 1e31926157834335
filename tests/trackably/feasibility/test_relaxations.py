"""What is asked of a reference, and how far bounds give way: no step, no link and no box is more than what is true."""

from dataclasses import replace

import numpy as np
import pytest

from tests.trackably.feasibility.test_impossible import told
from trackably import ConstrainedSystem, LinearSystem, Polytope
from trackably.feasibility.certain import certainly_missing
from trackably.feasibility.program import least
from trackably.feasibility.steps import Steps, Value

STEP = 0.05


def test_bounds_that_give_way_give_way_in_the_boxes_too():
    """A planted multiplier of the last state alone: -1 - 2 d + 2 (1.5 - 0.2 d) = 1 + 2 d, all of it by the boxes."""
    system = LinearSystem.scalar(1.0, 1.0, sampling_time=1.0)
    steps = Steps(ConstrainedSystem(system, Polytope.box([-1], [1]), Polytope.box([1.5], [1.7])), 0.0, 3)
    found = least(steps, steps.widths)
    assert found is not None
    assert found.missing == pytest.approx(1 / 4.4)
    planted = {"at_lower": np.zeros(6), "at_upper": np.eye(6)[4]}
    for claimed in (0.01, 1 / 4.4, 1.0):
        assert certainly_missing(replace(found, missing=claimed, **planted)) <= 1 / 4.4


def test_given_values_that_give_way_do_so_where_they_bound_the_first_state():
    """The state is free: 0 - d + 2 · 1.5 = 1 + d, planted is the multiplier of the last value."""
    system = LinearSystem.scalar(1.0, 1.0, sampling_time=1.0)
    plant = ConstrainedSystem(system, Polytope.box([-np.inf], [np.inf]), Polytope.box([1.5], [1.7]))
    steps = Steps(plant, 0.0, 3, (Value(0, "state", 0.0, 0.1), Value(2, "state", 0.0, 1.0)))
    found = least(steps, np.where(steps.is_given, steps.widths, 0.0))
    assert found is not None
    assert found.missing == pytest.approx(1.0)
    planted = {"at_lower": np.zeros(5), "at_upper": np.eye(5)[4]}
    for claimed in (0.01, 1.0, 1.5, 3.0):
        assert certainly_missing(replace(found, missing=claimed, **planted)) <= 1.0


def test_times_are_linked_where_windows_of_values_meet():
    """Values hold up to 1e-6 of a step beside their times, and no further."""
    for steps in (1, 3, 10):
        for beside, are_linked in ((-0.9e-6, True), (0.9e-6, True), (-1.1e-6, False), (1.1e-6, False), (1e-3, False)):
            found = told({0.0: {"position": 0.0}, STEP * (steps + beside): {"position": 0.9}})
            assert (found is not None) == are_linked


def test_what_lies_before_the_claim_is_not_examined():
    """It comes from outside of its bounds, and brakes in time."""
    inwards = {0.0: {"position": -0.9, "velocity": 0.5}}
    assert told(inwards) is None
    assert told(inwards, claim=(0.0, 9.0)) is None
    assert told(inwards, claim="all_phases").given == "velocity = 0.5 at t = 0 s"
    assert told({3.0: inwards[0.0]}).given == "velocity = 0.5 at t = 3 s"
