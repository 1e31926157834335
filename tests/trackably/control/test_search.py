"""Where full steps do not converge, trust regions search: what they find is admissible, and a minimum."""

import numpy as np
import pytest
from scipy.optimize import minimize

from tests.local_search.cases import Case, cases
from trackably.control.controller import Controller
from trackably.control.references import TabulatedReference
from trackably.control.simulation import simulate
from trackably.control.stepping import Infeasible, Plan, Status
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.nonlinear import NonlinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Window

HARD = [(0.5, 3, 3), (0.5, 10, 6), (0.8, 10, 1)]


def hard(alpha: float, horizon: int, number: int) -> Case:
    return cases(alpha, horizon, moving=False, states=number + 1)[number]


def cost_near(case: Case, result: Plan) -> float:
    """Return the cost of the minimum that SLSQP finds from a plan, in states and inputs."""
    window, N = case.reference.window(0, case.controller.horizon), case.controller.horizon
    system, (Q, R) = case.controller.plant.system, (case.controller.Q[0, 0], case.controller.R[0, 0])

    def split(z):
        return np.concatenate([case.state, z[: N - 1], window.states[-1]])[:, None], z[N - 1 :, None]

    def cost(z):
        x, u = split(z)
        return float(Q * np.sum((x - window.states) ** 2) + R * np.sum((u - window.inputs) ** 2))

    def missed(z):
        x, u = split(z)
        return (system.successor(x[:-1], u) - x[1:]).ravel()

    found = minimize(
        cost,
        np.concatenate([result.states[1:-1].ravel(), result.inputs.ravel()]),
        method="SLSQP",
        bounds=[(-case.sine.reach, case.sine.reach)] * (N - 1) + [(-case.sine.most, case.sine.most)] * N,
        constraints=[{"type": "eq", "fun": missed}],
        options={"ftol": 1e-13, "maxiter": 300},
    )
    assert np.max(np.abs(missed(found.x))) < 1e-9
    return float(found.fun)


@pytest.mark.parametrize("which", HARD, ids=str)
def test_what_is_found_is_followed_keeps_the_bounds_and_is_a_minimum(which):
    case = hard(*which)
    result, plant = case.answer, case.controller.plant
    assert result.status is Status.ADMISSIBLE  # full steps do not converge there
    followed = plant.system.successor(result.states[:-1], result.inputs)
    np.testing.assert_allclose(followed, result.states[1:], atol=1e-9)
    assert result.terminal_residual < 1e-7
    assert result.slack >= -2e-7
    assert np.min(plant.input_set.margin(result.inputs)) >= -2e-6
    assert result.cost == pytest.approx(cost_near(case, result), rel=1e-6)


def test_the_closed_loop_converges_and_its_cost_falls():
    case = hard(0.8, 10, 1)
    loop = simulate(case.controller, case.reference, case.state, 25)
    assert not loop.without_plan
    assert np.max(loop.cost_increases) <= 1e-9 * loop.costs[0]
    assert np.max(np.abs(loop.errors[-5:])) < 1e-6
    assert np.min(case.controller.plant.state_set.margin(loop.states[1:])) >= -1e-6


def test_coupled_states_far_from_the_reference():
    pair = NonlinearSystem.of(
        lambda x, u: [x[0] + 0.6 * np.sin(3 * x[1]) + 0.3 * u[0], x[1] + 0.5 * x[0] * x[1] + 0.3 * u[1]],
        ["a", "b"],
        ["u", "w"],
        0.1,
    )
    sets = Polytope.box([-2.0, -2.0], [2.0, 2.0]), Polytope.box([-3.0, -3.0], [3.0, 3.0])
    controller = Controller(ConstrainedSystem(pair, *sets), 8, np.eye(2), 0.1 * np.eye(2))
    at_rest = TabulatedReference(0, Window(np.zeros((9, 2)), np.zeros((8, 2))))
    result = controller.step(0, np.array([1.2, 1.2]), at_rest)
    assert isinstance(result, Plan), result.explanation
    assert result.slack >= -2e-7
    # b⁺ = 1.9 + 0.5 · 1.9² + 0.3 w is at least 2.805: no input keeps it below two.
    lost = controller.step(0, np.array([1.9, 1.9]), at_rest)
    assert isinstance(lost, Infeasible)
    assert lost.is_local
    assert lost.widening > 0.1
