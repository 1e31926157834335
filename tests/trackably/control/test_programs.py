"""What is compiled once gives the solver the numbers that cvxpy gives it anew each time, and the same optima."""

import cvxpy as cp
import numpy as np
import pytest

from tests.trackably.control import instances
from trackably.arrays import Array
from trackably.control.controller import scaled_controller
from trackably.control.programs import CompiledProgram

HORIZON = 4
FIRST_TOLERANCE = dict.fromkeys(("tol_gap_abs", "tol_gap_rel", "tol_feas"), 1e-12)


def programs() -> dict[str, CompiledProgram]:
    """Those of a controller, and programs with one kind of constraints."""
    programs = scaled_controller(instances.double_integrator(), HORIZON).formulation.programs
    x, limit = cp.Variable(3), cp.Parameter(3)
    return {
        "tracking": programs.tracking,
        "widening": programs.widening,
        "terminal error": programs.terminal_error,
        "equations alone": CompiledProgram(cp.Problem(cp.Minimize(cp.sum_squares(x)), [x == limit])),
        "inequalities alone": CompiledProgram(cp.Problem(cp.Minimize(cp.sum(x)), [x >= limit])),
    }


def drawn(compiled: CompiledProgram, seed: int) -> None:
    """Give the parameters values that are near those of a plan."""
    rng = np.random.default_rng(seed)
    for parameter in compiled.problem.parameters():
        parameter.value = 0.1 * rng.standard_normal(parameter.shape) + 0.05


@pytest.mark.parametrize("name", programs())
def test_the_numbers_are_those_of_cvxpy_to_the_last_bit(name: str) -> None:
    compiled = programs()[name]
    for seed in range(10):
        drawn(compiled, seed)
        data, _, _ = compiled.problem.get_problem_data(cp.CLARABEL, solver_opts={})
        A, b = compiled._form.constraints_at(compiled._values())
        assert A.toarray().tobytes() == data["A"].toarray().tobytes()
        assert (A.indptr.tolist(), A.indices.tolist()) == (data["A"].indptr.tolist(), data["A"].indices.tolist())
        assert b.tobytes() == data["b"].tobytes()
        assert compiled._form.q.tobytes() == data["c"].tobytes()


def test_the_optima_of_a_controller_are_those_of_cvxpy_to_the_last_bit(monkeypatch: pytest.MonkeyPatch) -> None:
    solve, statuses = CompiledProgram.solve, []

    def compared(compiled: CompiledProgram) -> dict[int, Array] | None:
        found = solve(compiled)
        compiled.problem.solve(cp.CLARABEL, **FIRST_TOLERANCE, max_iter=50)
        statuses.append(compiled.problem.status)
        if statuses[-1] == cp.OPTIMAL:
            assert found is not None
            assert all(found[v.id].tobytes() == v.value.tobytes() for v in compiled.problem.variables())
        elif statuses[-1] == cp.INFEASIBLE:
            assert found is None
        return found

    monkeypatch.setattr(CompiledProgram, "solve", compared)
    plant = instances.double_integrator()
    controller, reference = scaled_controller(plant, 15), instances.at_rest(plant, 1.1)
    for position in (0.0, 0.6, 1.1):
        for velocity in (-1.9, 0.5, 1.2):
            controller.step(0, np.array([position, velocity]), reference)
    assert statuses.count(cp.OPTIMAL) >= 5
    assert cp.INFEASIBLE in statuses


def test_what_has_no_solution_has_none() -> None:
    x, least = cp.Variable(2), cp.Parameter(2)
    compiled = CompiledProgram(cp.Problem(cp.Minimize(cp.sum_squares(x)), [x >= least, x <= 1]))
    least.value = np.array([0.5, 2.0])
    assert compiled.solve() is None
    least.value = np.array([0.5, -2.0])
    np.testing.assert_allclose(compiled.solve()[x.id], [0.5, 0.0], atol=1e-6)
    least.value = np.array([0.5, np.inf])
    with pytest.raises(ArithmeticError, match="not finite"):
        compiled.solve()


def test_an_objective_with_parameters_is_refused() -> None:
    x, towards = cp.Variable(2), cp.Parameter(2)
    with pytest.raises(ValueError, match="no parameters in its objective"):
        CompiledProgram(cp.Problem(cp.Minimize(towards @ x), [x >= 0]))
