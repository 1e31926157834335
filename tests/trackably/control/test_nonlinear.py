"""Nonlinear systems: sequential linearisation finds what a general method finds."""

import numpy as np
import pytest

from tests.trackably.control import naive
from tests.trackably.control.instances import NONLINEAR, TANK, bump
from trackably.control.search import apply_inputs
from trackably.control.stepping import Infeasible, Plan


@pytest.mark.parametrize("name", NONLINEAR)
def test_the_optimum_is_that_of_a_general_method(name):
    case = NONLINEAR[name]
    result = case.controller.step(2, case.start, case.reference)
    assert isinstance(result, Plan)
    window = case.reference.window(2, case.controller.horizon)
    assert result.cost == pytest.approx(naive.cost_of_a_minimum(case.controller, case.start, window), rel=1e-5)
    applied = apply_inputs(case.controller.plant.system, case.start, result.inputs)
    np.testing.assert_allclose(applied.states, result.states, atol=1e-9)
    assert result.slack == pytest.approx(0, abs=1e-7)  # some bound is active


def test_infeasibility_is_explained_by_the_least_widening():
    result = NONLINEAR["tank"].controller.step(0, np.array([0.3]), bump(TANK, [1.2], [0.0], 60.0))
    assert isinstance(result, Infeasible)
    assert result.quantity == "inflow"
    assert result.widening > 0.1
    # With the inflow at its widened bound all along, the tank is just full enough.
    wider = np.full((12, 1), 0.068 + result.excess)
    assert apply_inputs(TANK.system, np.array([0.3]), wider).states[-1] == pytest.approx([1.2], abs=1e-7)
