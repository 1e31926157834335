"""What is compiled once gives the solver the numbers that cvxpy gives it anew each time, and the same optima."""

import cvxpy as cp
import numpy as np
import pytest

from tests.trackably.control import instances
from trackably.control.controller import scaled_controller
from trackably.control.programs import CompiledProgram

HORIZON = 4


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
