"""Nonlinear systems: sequential linearisation finds what a general method finds, and loops keep their sets."""

import numpy as np
import pytest

from tests.trackably.control import naive
from trackably.control.controller import Controller
from trackably.control.search import apply_inputs
from trackably.control.simulation import simulate
from trackably.control.stepping import Infeasible, Plan
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.signal import KernelSum
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.library import tank
from trackably.systems.nonlinear import NonlinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference

TANK = ConstrainedSystem(tank(5.0, outflow=0.05), Polytope.box([0.3], [1.25]), Polytope.box([0.02], [0.068]))
PAIR = ConstrainedSystem(
    NonlinearSystem.of(
        lambda x, u: [0.9 * x[0] + 0.3 * np.sin(x[1]) + u[0], 0.8 * x[1] + 0.2 * x[0] * x[1] + (1 + x[0] ** 2) * u[1]],
        ["a", "b"],
        ["u", "w"],
        0.1,
    ),
    Polytope.box([-2.0, -2.0], [2.0, 2.0]),
    Polytope.box([-0.25, -0.3], [0.25, 0.3]),
)


def bump(plant, levels, heights, width) -> Reference:
    signals = tuple(
        KernelSum(SquaredExponential(1.0, width), level, np.array([4 * width]), np.array([height]))
        for level, height in zip(levels, heights, strict=True)
    )
    return Reference(signals, plant)


CASES = {
    "tank": (Controller(TANK, 12, np.eye(1), np.eye(1)), bump(TANK, [0.8], [0.3], 60.0), np.array([0.6])),
    "pair": (
        Controller(PAIR, 8, np.eye(2), 0.1 * np.eye(2)),
        bump(PAIR, [0.1, 0.0], [0.3, 0.4], 1.0),
        np.array([1.0, -0.7]),
    ),
}


@pytest.fixture(params=CASES)
def case(request):
    return CASES[request.param]


def test_the_optimum_is_that_of_a_general_method(case):
    controller, reference, state = case
    result = controller.step(2, state, reference)
    assert isinstance(result, Plan)
    assert result.cost == pytest.approx(
        naive.cost_of_a_minimum(controller, state, reference.window(2, controller.horizon)), rel=1e-5
    )
    applied = apply_inputs(controller.plant.system, state, result.inputs)
    np.testing.assert_allclose(applied.states, result.states, atol=1e-9)
    assert result.slack == pytest.approx(0, abs=1e-7)  # some bound is active


def test_feasibility_is_kept_and_the_cost_falls(case):
    controller, reference, state = case
    loop = simulate(controller, reference, state, 100)
    assert loop.first_infeasible_step is None
    assert np.max(loop.cost_increases) <= 1e-11 * max(1.0, loop.costs[0])
    assert np.max(np.abs(loop.errors[-20:])) < 1e-9
    assert np.min(controller.plant.input_set.margin(loop.inputs)) >= 0
    assert np.min(controller.plant.state_set.margin(loop.states)) >= -1e-9


def test_infeasibility_is_explained_by_the_least_widening():
    controller = CASES["tank"][0]
    result = controller.step(0, np.array([0.3]), bump(TANK, [1.2], [0.0], 60.0))
    assert isinstance(result, Infeasible)
    assert result.quantity == "inflow"
    assert result.widening > 0.1
    assert "no plan was found that ends on the reference" in result.explanation
    # With the inflow at its widened bound all along, the tank is just full enough.
    wider = np.full((12, 1), 0.068 + result.excess)
    assert apply_inputs(TANK.system, np.array([0.3]), wider).states[-1] == pytest.approx([1.2], abs=1e-7)
