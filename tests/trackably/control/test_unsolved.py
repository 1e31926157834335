"""Where a step has no answer it says so: no error leaves it, and the input that it offers is admissible."""

import numpy as np
import pytest

from tests.trackably.control.test_nonlinear import CASES
from trackably.control.controller import Controller
from trackably.control.references import TabulatedReference
from trackably.control.simulation import apply_fallback, simulate
from trackably.control.stepping import Unsolved
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Window


@pytest.mark.parametrize("growth", [1e20, 1e200])
def test_a_system_whose_predictions_overflow(growth):
    unit = Polytope.box([-1.0], [1.0])
    plant = ConstrainedSystem(LinearSystem.scalar(growth, 0.5, sampling_time=0.1), unit, unit)
    reference = TabulatedReference(0, Window(np.zeros((21, 1)), np.zeros((20, 1))))
    found = Controller(plant, 20, np.eye(1), np.eye(1)).step(0, np.array([0.5]), reference)
    assert isinstance(found, Unsolved), found
    assert "overflow" in found.explanation
    assert np.array_equal(found.fallback, [0.0])


def test_a_loop_ends_where_the_system_is_not_defined():
    """The step offers the input of the plan before; what it leads to has no value either."""
    (controller, reference, _), state = CASES["tank"], np.array([-0.5])
    found = controller.step(0, state, reference, np.full((12, 1), 0.03))
    assert isinstance(found, Unsolved), found
    assert found.explanation.startswith("at step 0 no answer: a plan leads where the system is not defined")
    assert np.array_equal(found.fallback, [0.03])
    loop = simulate(controller, reference, state, 5, on_infeasible=apply_fallback)
    assert (len(loop.inputs), len(loop.states)) == (0, 1)
    assert "under the input applied" in loop.unsolved[-1].reason
