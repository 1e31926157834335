"""Windows of interpolated and tabulated references: the inputs lead from each state to the next."""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.control import interpolated
from tests.trackably.certificates.references import certified
from tests.trackably.control import instances
from trackably.control.controller import Controller
from trackably.control.references import TabulatedReference
from trackably.control.simulation import simulate
from trackably.control.stepping import Plan
from trackably.gp.samples import Samples
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.nonlinear import NonlinearSystem
from trackably.systems.polytopes import Polytope

PLANT = instances.double_integrator()
_, STENCIL = PLANT.flatness.states[0].stencil
TIMES = np.arange(0.0, 2.1, 0.5)
POSITIONS = Samples(TIMES, np.array([0.0, 0.4, 0.4, -0.2, 0.1]), stencil=STENCIL)


def test_lines_through_positions_are_straight_from_sample_to_sample():
    """But for the corners, where a position is an average of the flat output over a step."""
    steps = np.flatnonzero(np.arange(41) % 10 > 1)
    positions = interpolated((POSITIONS,), PLANT).state(steps)[:, 0]
    np.testing.assert_allclose(positions, np.interp(0.05 * steps, TIMES, POSITIONS.values), atol=1e-9)


def test_a_table_has_the_windows_of_its_reference():
    reference = certified("example1").reference
    table = TabulatedReference.of(reference, 5, 90)
    for k in (5, 33, 70):
        for mine, original in zip(table.window(k, 20), reference.window(k, 20), strict=True):
            np.testing.assert_allclose(mine, original, atol=1e-12)


def box(system):
    n, m = len(system.states), len(system.inputs)
    return ConstrainedSystem(system, Polytope.box([-3.0] * n, [3.0] * n), Polytope.box([-9.0] * m, [9.0] * m))


def cubic(gain):
    return NonlinearSystem.of(lambda x, u: [x[0] + gain * (u[0] - x[0] ** 3)], ["x"], ["u"], 0.1)


OWN = LinearSystem([[1.0, 0.1], [0.0, 1.0]], [[0.0], [0.1]], states=("position", "velocity"), sampling_time=0.1)
OTHERS = {
    "other names": (
        OWN,
        replace(OWN, states=("angle", "rate")),
        r"its states \('angle', 'rate'\), the controller's \(",
    ),
    "another matrix": (OWN, replace(OWN, A=OWN.A + np.diag([0, 1e-6])), "the same state and input, the next velocity"),
    "another gain": (cubic(0.1), cubic(0.2), "from the same state and input, the next x differs"),
}


@pytest.mark.parametrize("name", OTHERS)
def test_a_controller_refuses_the_reference_of_another_system(name):
    own, other, difference = OTHERS[name]
    controller, reference = Controller(box(own), 5), instances.at_rest(box(other), 0.1)
    state = np.full(len(own.states), 0.1)
    for call in (lambda: controller.step(0, state, reference), lambda: simulate(controller, reference, state, 2)):
        with pytest.raises(ValueError, match=f"the reference is of another system than the controller: .*{difference}"):
            call()


@pytest.mark.parametrize("own", [OWN, cubic(0.1)])
def test_what_counts_is_the_system_and_not_the_object_or_the_sets(own):
    again = cubic(0.1) if isinstance(own, NonlinearSystem) else replace(own, A=own.A * (1 + 1e-15))
    narrower = Polytope.box([-2.0] * len(own.states), [2.0] * len(own.states))
    reference = instances.at_rest(replace(box(again), state_set=narrower), 0.1)
    assert isinstance(Controller(box(own), 5).step(0, reference.window(0, 1).states[0], reference), Plan)
