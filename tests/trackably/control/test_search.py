"""Where full steps lead to no plan, a search does: what it finds is admissible, and a minimum."""

import numpy as np
import pytest

from tests.local_search.cases import cases
from tests.trackably.control import naive
from trackably.control.stepping import Status


@pytest.mark.parametrize(
    ("alpha", "horizon", "number"), [(0.5, 3, 3), (0.5, 10, 6), (0.8, 10, 1), (0.7, 10, 4), (0.8, 10, 5), (0.9, 15, 1)]
)
def test_what_is_found_is_followed_keeps_the_bounds_and_is_a_minimum(alpha, horizon, number):
    case = cases(alpha, horizon, moving=False, states=number + 1)[number]
    result, plant = case.answer, case.controller.plant
    assert result.status is not Status.ADMISSIBLE
    followed = plant.system.successor(result.states[:-1], result.inputs)
    np.testing.assert_allclose(followed, result.states[1:], atol=1e-9)
    assert result.terminal_residual < 1e-7
    assert result.slack >= -2e-7
    assert np.min(plant.input_set.margin(result.inputs)) >= -2e-6
    window = case.reference.window(0, case.controller.horizon)
    near = naive.cost_of_a_minimum(case.controller, case.state, window, result)
    assert result.cost == pytest.approx(near, rel=1e-6)
