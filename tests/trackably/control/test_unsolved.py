"""Where a step has no answer it says so: no error leaves it, and the input that it offers is admissible."""

import numpy as np
import pytest

from tests.trackably.control.instances import NONLINEAR
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
    controller = Controller(plant, 20, np.eye(1), np.eye(1))
    for guess, offered in ((None, 0.0), (np.full((20, 1), 0.25), 0.25)):  # the first input of the plan before
        found = controller.step(0, np.array([0.5]), reference, guess)
        assert isinstance(found, Unsolved), found
        assert "overflow" in found.explanation
        assert np.array_equal(found.fallback, [offered])


def test_a_loop_ends_where_the_system_is_not_defined():
    case = NONLINEAR["tank"]
    loop = simulate(case.controller, case.reference, np.array([-0.5]), 5, on_infeasible=apply_fallback)
    assert (len(loop.inputs), len(loop.states)) == (0, 1)
    no_plan, no_state = loop.unsolved
    assert no_plan.explanation.startswith("at step 0 no answer: a plan leads where the system is not defined")
    assert np.array_equal(no_plan.fallback, case.reference.input(0))
    assert "under the input applied" in no_state.reason
