"""The closed loop: what a trackable reference guarantees, and what is lost without one."""

from functools import partial

import numpy as np
import pytest

from tests.trackably.certificates.references import certified, unconstrained
from tests.trackably.control import instances
from tests.trackably.plants import AXIS
from trackably import certify
from trackably.control.controller import Controller
from trackably.control.simulation import simulate

HORIZON = 20
ACCURACY = 1e-11
"""By how much costs may rise, as a part of the first cost: the accuracy of the solver."""


def controller(reference) -> Controller:
    return Controller(reference.plant, HORIZON, np.eye(1), np.eye(1))


def assert_decreasing(loop):
    assert np.all(loop.cost_increases <= ACCURACY * max(loop.costs[0], 1e-9))


@pytest.mark.parametrize("example", ["example1", "example2"])
def test_on_a_certified_reference_every_step_is_feasible(example):
    reference = certified(example).reference
    plant = reference.plant
    loop = simulate(controller(reference), reference, reference.state(0) - 0.5, 300)
    assert loop.first_infeasible_step is None
    assert len(loop.inputs) == 300
    assert loop.widened == 0
    assert_decreasing(loop)
    assert np.max(np.abs(loop.errors[250:])) < 1e-10
    assert np.min(plant.input_set.margin(loop.inputs)) >= 0
    assert np.min(plant.state_set.margin(loop.states[1:])) >= -1e-12


@pytest.mark.parametrize(
    ("horizon", "first_step", "fitting"), [(5, 0, 14), (5, 13, 1), (5, 14, 0), (5, 20, 0), (2, 1, 16)]
)
def test_beyond_the_end_of_a_reference_the_error_says_how_many_steps_fit(horizon, first_step, fitting):
    reference = certify(np.zeros(30), AXIS, (0.0, 1.0), interpolation="linear")  # steps 0 to 20
    close = partial(simulate, Controller(AXIS, horizon), reference, [0, 0], first_step=first_step)
    said = {0: "no step fits", 1: "1 step fits"}.get(fitting, f"{fitting} steps fit")
    with pytest.raises(ValueError, match=rf"need the reference up to step {first_step + horizon + 51}; {said}: "):
        close(50)
    if fitting:
        assert len(close(fitting).inputs) == fitting


def test_feasibility_ends_when_the_reference_leaves_the_state_set_within_the_horizon():
    reference = unconstrained("example1")
    plant = reference.plant
    leaves = instances.first_outside(reference, plant.state_set, reference.state)
    loop = simulate(controller(reference), reference, reference.state(0) - 0.5, 100)
    assert loop.first_infeasible_step == leaves - HORIZON
    assert loop.infeasible[0].at_step == leaves
    excess = -plant.state_set.margin(reference.state(leaves)) / np.ptp([-2.0, 0.05])
    assert loop.infeasible[0].widening == pytest.approx(excess, rel=1e-6)


@pytest.mark.parametrize("seed", instances.SEEDS)
def test_random_systems_stay_feasible(seed):
    """In every third instance the reference touches its bounds."""
    case = instances.instance(seed)
    plant = case.reference.plant
    loop = simulate(case.controller, case.reference, case.start, instances.STEPS)
    assert loop.first_infeasible_step is None
    assert_decreasing(loop)
    assert np.max(np.abs(loop.errors[-10:])) < 1e-6
    assert np.min(plant.input_set.margin(loop.inputs)) >= -1e-15
    assert (
        np.min(plant.state_set.margin(loop.states[1:]) / np.min(plant.state_set.upper - plant.state_set.lower)) > -1e-6
    )


def test_the_plant_may_differ_from_the_model():
    """A plant that moves by 0.01 more in each step is the model with a disturbance of 0.01."""
    reference, pushed = certified("example1").reference, np.array([0.01])
    mine, model = controller(reference), reference.plant.system
    disturbed = simulate(mine, reference, reference.state(0), 30, disturbances=lambda k, x: pushed)
    other = simulate(mine, reference, reference.state(0), 30, successor=lambda k, x, u: model.successor(x, u) + pushed)
    assert np.array_equal(other.states, disturbed.states)
    assert np.array_equal(other.inputs, disturbed.inputs)
    with pytest.raises(ValueError, match="successor: expected 1 numbers at step 0"):
        simulate(mine, reference, reference.state(0), 30, successor=lambda k, x, u: np.zeros(2))
