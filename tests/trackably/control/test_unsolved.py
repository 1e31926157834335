"""Where a step has no answer it says so: no error leaves it, and the input that it offers is admissible."""

import numpy as np
import pytest

from tests.trackably.control import instances
from tests.trackably.control.test_nonlinear import CASES, TANK
from trackably.control.controller import Controller
from trackably.control.programs import StepPrograms
from trackably.control.references import TabulatedReference
from trackably.control.simulation import apply_fallback, shifted_inputs, simulate
from trackably.control.stepping import Plan, Status, Unsolved
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Window

PLANT = instances.double_integrator()
CONTROLLER = Controller(PLANT, 20, np.diag([10.0, 1.0]), 0.1 * np.eye(1))
AT_REST = instances.at_rest(PLANT, 1.2)
TIGHT = np.array([1.0, 1.2])  # a bound is active


def unsolved(result, reason: str) -> Unsolved:
    assert isinstance(result, Unsolved), result
    assert reason in result.reason
    assert result.explanation == f"at step {result.k} no answer: {result.reason}"
    return result


@pytest.fixture
def broken_solver(monkeypatch):
    """Stands for numbers that no solver masters."""
    monkeypatch.setattr(StepPrograms, "solve", lambda *_: None)


def test_numbers_beyond_the_solver(broken_solver):
    found = unsolved(CONTROLLER.step(3, TIGHT, AT_REST), "beyond the solver")
    assert found.k == 3
    np.testing.assert_allclose(found.fallback, AT_REST.input(3), atol=1e-15)


@pytest.mark.parametrize("size", [1e120, 1e200, 1e300, 1.7e308])
def test_states_that_overflow(size):
    for state in ([size, 0.0], [0.0, size], [-size, size]):
        result = CONTROLLER.step(0, np.array(state), AT_REST)
        assert not isinstance(result, Plan)
        assert PLANT.input_set.margin(result.fallback) >= 0


@pytest.mark.parametrize("growth", [1e20, 1e200])
def test_a_system_whose_predictions_overflow(growth):
    plant = ConstrainedSystem(LinearSystem.scalar(growth, 0.5, sampling_time=0.1), *_sets())
    reference = TabulatedReference(0, Window(np.zeros((21, 1)), np.zeros((20, 1))))
    found = Controller(plant, 20, np.eye(1), np.eye(1)).step(0, np.array([0.5]), reference)
    unsolved(found, "overflow")
    assert np.array_equal(found.fallback, [0.0])


def _sets() -> tuple[Polytope, Polytope]:
    return Polytope.box([-1.0], [1.0]), Polytope.box([-1.0], [1.0])


def test_a_formula_that_is_not_defined():
    controller, reference, _ = CASES["tank"]
    found = controller.step(0, np.array([-0.5]), reference, np.full((12, 1), 0.03))
    unsolved(found, "a plan leads where the system is not defined")
    assert np.array_equal(found.fallback, [0.03])


def test_a_reference_that_is_not_defined():
    class Undefined:
        def window(self, k: int, horizon: int) -> Window:
            raise ZeroDivisionError("no reference here")

    unsolved(CONTROLLER.step(0, TIGHT, Undefined()), "no reference here")
    broken = TabulatedReference(0, Window(np.full((21, 2), np.nan), np.full((20, 1), 9.0)))
    found = unsolved(CONTROLLER.step(0, TIGHT, broken), "the reference is not defined")
    np.testing.assert_allclose(found.fallback, [4.0])  # pulled inside


def test_a_guess_that_is_a_plan_outlasts_a_broken_solver(monkeypatch):
    controller, reference, state = CASES["tank"]
    first = controller.step(0, state, reference)
    here = TANK.system.successor(state, first.input)
    monkeypatch.setattr(StepPrograms, "solve", lambda *_: None)
    kept = controller.step(1, here, reference, shifted_inputs(first, reference))
    assert isinstance(kept, Plan)
    assert kept.status is Status.KEPT


def test_a_loop_ends_where_the_system_is_not_defined():
    controller, reference, _ = CASES["tank"]
    loop = simulate(controller, reference, np.array([-0.5]), 5, on_infeasible=apply_fallback)
    assert len(loop.inputs) == 0
    assert len(loop.states) == 1
    assert "under the input applied" in loop.unsolved[-1].reason
