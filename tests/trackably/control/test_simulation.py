"""The closed loop: what a trackable reference guarantees, and what is lost without one."""

import numpy as np
import pytest

from tests.trackably.control import instances
from trackably.control.controller import Controller
from trackably.control.simulation import simulate

HORIZON = 20
ACCURACY = 1e-11
"""By how much costs may rise, as a part of the first cost: the accuracy of the solver."""


def controller(example, horizon=HORIZON) -> Controller:
    return Controller(example.learning.plant, horizon, np.eye(1), np.eye(1))


def assert_decreasing(loop):
    assert np.all(loop.cost_increases <= ACCURACY * max(loop.costs[0], 1e-9))


@pytest.mark.parametrize("away", [0.0, -0.5])
def test_on_a_certified_reference_every_step_is_feasible(example, away):
    plant = example.learning.plant
    loop = simulate(controller(example), example.certified, example.certified.state(0) + away, 2000)
    assert loop.first_infeasible_step is None
    assert len(loop.inputs) == 2000
    assert loop.widened == 0
    assert_decreasing(loop)
    assert np.max(np.abs(loop.errors[1000:])) < 1e-10
    assert np.min(plant.input_set.margin(loop.inputs)) >= 0
    assert np.min(plant.state_set.margin(loop.states[1:])) >= -1e-12


@pytest.mark.parametrize("away", [0.0, -0.5])
def test_feasibility_ends_when_the_reference_leaves_the_state_set_within_the_horizon(example1, away):
    reference, plant = example1.unconstrained, example1.learning.plant
    leaves = instances.first_outside(reference, plant.state_set, reference.state)
    loop = simulate(controller(example1), reference, reference.state(0) + away, 500)
    assert loop.first_infeasible_step == leaves - HORIZON
    assert loop.infeasible[0].at_step == leaves
    excess = -plant.state_set.margin(reference.state(leaves)) / np.ptp([-2.0, 0.05])
    assert loop.infeasible[0].widening == pytest.approx(excess, rel=1e-6)


@pytest.mark.parametrize("seed", instances.SEEDS)
def test_random_systems_stay_feasible(seed):
    """With 200 steps each. In every third instance the reference touches its bounds."""
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


def test_the_plant_may_differ_from_the_model(example1):
    """A plant that moves by 0.01 more in each step is the model with a disturbance of 0.01."""
    mine, reference = controller(example1), example1.certified
    model, pushed = example1.learning.plant.system, np.array([0.01])
    disturbed = simulate(mine, reference, reference.state(0), 30, disturbances=lambda k, x: pushed)
    other = simulate(mine, reference, reference.state(0), 30, successor=lambda k, x, u: model.successor(x, u) + pushed)
    assert np.array_equal(other.states, disturbed.states)
    assert np.array_equal(other.inputs, disturbed.inputs)
    with pytest.raises(ValueError, match="successor: expected 1 numbers at step 0"):
        simulate(mine, reference, reference.state(0), 30, successor=lambda k, x, u: np.zeros(2))
