"""The programs of a step have the optima that a modelling language finds, and none where there is none."""

import cvxpy as cp
import numpy as np
import pytest

from tests.trackably.control import instances
from tests.trackably.control.tube.instances import LOOPS
from trackably.control.bounds import Slack
from trackably.control.controller import scaled_controller
from trackably.control.programs import StepPrograms

HORIZON = 4

PROGRAMS: dict[str, StepPrograms] = {
    "measured start": scaled_controller(instances.double_integrator(), HORIZON).formulation.linear_model.programs,
    "start in a zonotope": LOOPS["pushed cart"].controller.formulation.linear_model.programs,
    "start in hulls": LOOPS["triangle"].controller.formulation.linear_model.programs,
}


def values(programs: StepPrograms, seed: int):
    """Draw x − x_r, defects and slack near those of a plan."""
    rng, (N, n, _) = np.random.default_rng(seed), programs.model.B.shape
    slack = Slack(
        rng.uniform(0.2, 1.0, (N + 1 - programs.start.first_bounded, len(programs.state_rows))),
        rng.uniform(0.2, 1.0, (N, len(programs.input_rows))),
    )
    return 0.05 * rng.standard_normal(n), 0.01 * rng.standard_normal((N, n)), slack


def modelled(programs: StepPrograms, aim: str, off, defects, slack: Slack) -> float:
    """The optimal value of the same program, as cvxpy writes it."""
    start, (N, n, m) = programs.start, programs.model.B.shape
    e, v, p, t = cp.Variable((N + 1, n)), cp.Variable((N, m)), cp.Variable(max(1, len(start.lower))), cp.Variable()
    kept = [e[0] == off - start.centre - (p @ start.directions if len(start.lower) else 0)]
    if len(start.lower):
        kept += [p >= start.lower, p <= 1]
    if len(start.sums):
        kept += [start.sums @ p == 1]
    kept += [e[i + 1] == programs.model.A[i] @ e[i] + programs.model.B[i] @ v[i] + defects[i] for i in range(N)]
    wider = t if aim == "widening" else 0.0
    kept += [e[start.first_bounded :] @ programs.state_rows.T <= slack.states + wider]
    kept += [v @ programs.input_rows.T <= slack.inputs + wider]
    if aim != "terminal_error":
        kept += [e[N] == 0]
    cost = {
        "tracking": sum(cp.quad_form(e[i], programs.Q) + cp.quad_form(v[i], programs.R) for i in range(N)),
        "widening": t,
        "terminal_error": cp.sum_squares(e[N]),
    }[aim]
    problem = cp.Problem(cp.Minimize(cost), kept)
    problem.solve(solver=cp.CLARABEL)
    return float(problem.value) if problem.status == cp.OPTIMAL else np.inf


def value(programs: StepPrograms, aim: str, found, defects, slack: Slack) -> float:
    """The value of what was found, once it is shown to keep what it must."""
    if found is None:
        return np.inf
    e, v = [found[0]], found[1]
    for A, B, of_step, d in zip(programs.model.A, programs.model.B, v, defects, strict=True):
        e.append(A @ e[-1] + B @ of_step + d)
    left = slack.states - np.array(e)[programs.start.first_bounded :] @ programs.state_rows.T
    least = min(left.min(), (slack.inputs - v @ programs.input_rows.T).min())
    if aim == "widening":
        return -float(least)
    assert least > -1e-8
    if aim == "terminal_error":
        return float(e[-1] @ e[-1])
    np.testing.assert_allclose(e[-1], 0.0, atol=1e-8)
    return float(sum(x @ programs.Q @ x + u @ programs.R @ u for x, u in zip(e, v, strict=False)))


@pytest.mark.parametrize("name", PROGRAMS)
@pytest.mark.parametrize("aim", ["tracking", "widening", "terminal_error"])
def test_the_optimum_is_that_of_a_modelling_language(name, aim):
    programs = PROGRAMS[name]
    for seed in range(4):
        off, defects, slack = values(programs, seed)
        end = None if aim == "terminal_error" else np.zeros(len(off))
        found = programs.solve(getattr(programs, aim), off, defects, slack, end)
        expected = modelled(programs, aim, off, defects, slack)
        assert value(programs, aim, found, defects, slack) == pytest.approx(expected, rel=1e-5, abs=1e-7)
