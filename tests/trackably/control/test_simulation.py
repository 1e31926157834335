"""The closed loop: what a trackable reference guarantees, and what is lost without one."""

from functools import partial

import numpy as np
import pytest

from tests.trackably.certificates.references import certified, unconstrained
from tests.trackably.checker.redundant import PLANE, in_the_plane
from tests.trackably.control import instances
from tests.trackably.control.instances import Instance
from tests.trackably.plants import AXIS
from trackably import PolynomialPieces, certify
from trackably.control.controller import Controller
from trackably.control.references import TabulatedReference
from trackably.control.simulation import apply_fallback, simulate
from trackably.control.stepping import Status
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Window

HORIZON = 20


def beside(reference) -> Instance:
    """Return the loop of a scalar system that begins beside its reference."""
    controller = Controller(reference.plant, HORIZON, np.eye(1), np.eye(1))
    return Instance(controller, reference, reference.state(0) - 0.5)


def cornered() -> Instance:
    """A reference at rest, a system that drifts, and inputs in a polytope that is no box."""
    system = LinearSystem([[1.0, 0.2], [0.0, 1.0]], [[1.0, 0.3], [0.2, 1.0]], [0.01, -0.02], sampling_time=0.1)
    U = Polytope.halfspaces([[1.0, 1.0], [-1.0, 0.0], [0.0, -1.0]], [0.1, 0.1, 0.1])
    plant = ConstrainedSystem(system, Polytope.box([-9.0, -9.0], [9.0, 9.0]), U)
    return Instance(Controller(plant, 10, np.eye(2), np.eye(2)), instances.at_rest(plant), np.array([0.6, -0.5]))


def redundant() -> Instance:
    """The reference's inputs are the smallest admissible ones, which differ from the smallest ones."""
    reference = in_the_plane().reference
    return Instance(Controller(PLANE, HORIZON, np.eye(4), 0.1 * np.eye(4)), reference, reference.state(0) + 0.02)


LOOPS = {
    **{name: (lambda name=name: beside(certified(name).reference), 300) for name in ("example1", "example2")},
    **{f"random {seed}": (partial(instances.instance, seed), instances.STEPS) for seed in range(9)},
    "inputs in a triangle": (cornered, 40),
    "redundant inputs": (redundant, 200),
    **{name: (partial(instances.NONLINEAR.get, name), 100) for name in instances.NONLINEAR},
    "a robot that waits": (instances.robot_beside_its_path, 80),
}
"""All reach bounds but some of the random ones."""


@pytest.mark.parametrize("name", LOOPS)
def test_on_a_trackable_reference_every_step_has_a_plan_bounds_are_kept_and_the_cost_falls(name):
    """V(k + 1) ≤ V(k) − ℓ(k) up to the accuracy of the solver, and the system ends on the reference."""
    make, steps = LOOPS[name]
    case = make()
    loop, plant = simulate(case.controller, case.reference, case.start, steps), case.controller.plant
    assert (len(loop.inputs), loop.without_plan) == (steps, ())
    assert not any(result.status is Status.WIDENED for result in loop.results)
    assert np.max(loop.cost_increases) <= 1e-11 * loop.costs[0]
    assert np.min(plant.input_set.margin(loop.inputs)) >= 0
    assert np.min(plant.state_set.margin(loop.states[1:])) >= -1e-12
    assert np.max(np.abs(loop.errors[-1])) < (1e-4 if "robot" in name else 1e-9)


@pytest.mark.parametrize(("first_step", "fitting"), [(0, 14), (13, 1), (14, 0)])
def test_beyond_the_end_of_a_reference_the_error_says_how_far_it_is_needed(first_step, fitting):
    reference = certify(PolynomialPieces([0.0, 1.45], [[0.0]]), AXIS, (0.0, 1.0))  # steps 0 to 20
    close = partial(simulate, Controller(AXIS, 5), reference, [0, 0], first_step=first_step)
    with pytest.raises(ValueError, match=rf"need the reference up to step {first_step + 56}: "):
        close(50)
    if fitting:
        assert len(close(fitting).inputs) == fitting


def test_feasibility_ends_when_the_reference_leaves_the_state_set_within_the_horizon():
    case = beside(unconstrained("example1"))
    states = case.reference.plant.state_set
    leaves = instances.first_outside(case.reference, states, case.reference.state)
    loop = simulate(case.controller, case.reference, case.start, 100)
    assert loop.infeasible[0].k == leaves - HORIZON
    assert loop.infeasible[0].at_step == leaves
    excess = -states.margin(case.reference.state(leaves)) / np.ptp([-2.0, 0.05])
    assert loop.infeasible[0].widening == pytest.approx(excess, rel=1e-6)


def test_a_reference_that_leaves_for_good_is_followed_along_the_bound():
    plant = certified("example1").reference.plant
    x = np.linspace(-0.1, 0.3, 63)[:, None]
    reference = TabulatedReference(0, Window(x, (x[1:] - 0.9 * x[:-1]) / 0.5))
    controller = Controller(plant, 10, np.eye(1), np.eye(1))
    loop = simulate(controller, reference, x[0], 50, on_infeasible=apply_fallback)
    np.testing.assert_allclose(loop.states[-10:], 0.05, atol=1e-6)
    np.testing.assert_allclose(np.minimum(x[:51], 0.05), loop.states, atol=0.03)


def test_the_plant_may_differ_from_the_model():
    """A plant that moves by 0.01 more in each step is the model with a disturbance of 0.01."""
    case, pushed = beside(certified("example1").reference), np.array([0.01])
    run, model = partial(simulate, case.controller, case.reference, case.start, 30), case.reference.plant.system
    disturbed = run(disturbances=lambda k, x: pushed)
    other = run(successor=lambda k, x, u: model.successor(x, u) + pushed)
    assert np.array_equal(other.states, disturbed.states)
    assert np.array_equal(other.inputs, disturbed.inputs)
