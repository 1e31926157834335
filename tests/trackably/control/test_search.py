"""Where full steps do not converge, trust regions search: what they find is admissible, and a minimum."""

import numpy as np
import pytest
from scipy.optimize import minimize

from tests.local_search.cases import Case, cases
from trackably.control.stepping import Plan, Status

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
