"""The law of units: the same problem in other units has the same answer, in its own units."""

from dataclasses import dataclass

import numpy as np
import pytest

from tests.trackably.control import instances
from tests.trackably.control.test_nonlinear import TANK, bump
from trackably.control.controller import Controller
from trackably.control.references import TabulatedReference
from trackably.control.stepping import Infeasible, Plan
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.nonlinear import NonlinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Window

ACCURACY = 1e-6
"""Of the widths of the sets."""

FREE = (-np.inf, np.inf)


@dataclass(frozen=True)
class Case:
    controller: Controller
    reference: TabulatedReference
    states: tuple[tuple[float, ...], ...]


def _case(controller: Controller, reference, *states: tuple[float, ...]) -> Case:
    return Case(controller, TabulatedReference.of(reference, 0, controller.horizon), states)


def _integrator(*bounds: tuple[float, float]) -> Case:
    plant = instances.double_integrator(*bounds)
    return _case(
        instances.controller_of(plant), instances.at_rest(plant, 1.2), (1.0, 1.2), (0.5, 0.0), (1.2, 0.3), (0.0, 0.0)
    )


def _tank() -> Case:
    reference = bump(TANK, [0.8], [0.3], 60.0)
    return _case(Controller(TANK, 12, np.eye(1), np.eye(1)), reference, (0.6,), (0.85,), (0.3,), (0.0001,))


CASES = {
    "integrator": _integrator(),
    "free position": _integrator(FREE),
    "free input": _integrator((-1.0, 1.2), (-2.0, 2.0), FREE),
    "nothing bounded": _integrator(FREE, FREE, FREE),
    "tank": _tank(),
}
UNITS = [(1e-12, 1e-12, 1.0), (1e-12, 1e12, 1e6), (3e8, 7e-9, 1e-9)]


def in_units(case: Case, x: np.ndarray, u: np.ndarray, cost: float) -> Case:
    """Return a case in which one former unit is `x` (n,), `u` (m,) and `cost` new ones."""
    old = case.controller
    plant = ConstrainedSystem(
        _system(old.plant.system, x, u), _box(old.plant.state_set, x), _box(old.plant.input_set, u)
    )
    Q, R = cost * old.Q / np.outer(x, x), cost * old.R / np.outer(u, u)
    values = case.reference.values
    reference = TabulatedReference(0, Window(values.states * x, values.inputs * u))
    states = tuple(tuple((np.array(state) * x).tolist()) for state in case.states)
    return Case(Controller(plant, old.horizon, Q, R), reference, states)


def _system(system, x, u):
    if isinstance(system, LinearSystem):
        A, B = system.A * x[:, None] / x, system.B * x[:, None] / u
        return LinearSystem(A, B, system.c * x, sampling_time=system.sampling_time)

    def tank(level, inflow):
        return [x[0] * (level[0] / x[0] + 2.5 * (inflow[0] / u[0] - 0.05 * np.sqrt(level[0] / x[0])))]

    return NonlinearSystem.of(tank, ["level"], ["inflow"], system.sampling_time)


def _box(bounded: Polytope, unit: np.ndarray) -> Polytope:
    scale = np.abs(bounded.rows) @ unit
    return Polytope(bounded.rows, bounded.lower * scale, bounded.upper * scale, bounded.dimension)


def units(case: Case, x: float, u: float) -> tuple[np.ndarray, np.ndarray]:
    """Return different units for each state and each input."""
    n, m = len(case.controller.Q), len(case.controller.R)
    return x * 10.0 ** -np.arange(n), u * 10.0 ** np.arange(m)


@pytest.fixture(scope="module", params=CASES)
def case(request) -> Case:
    return CASES[request.param]


@pytest.fixture(scope="module")
def answers(case) -> list:
    return [case.controller.step(0, np.array(state), case.reference) for state in case.states]


@pytest.mark.parametrize("unit", UNITS, ids=str)
def test_the_same_problem_in_other_units_has_the_same_answer(case, answers, unit):
    x, u = units(case, *unit[:2])
    other = in_units(case, x, u, unit[2])
    scales = case.controller.formulation.scales
    for state, mine in zip(other.states, answers, strict=True):
        found = other.controller.step(0, np.array(state), other.reference)
        assert type(found) is type(mine)
        if isinstance(mine, Plan):
            assert found.status is mine.status
            assert found.cost / unit[2] == pytest.approx(mine.cost, rel=ACCURACY)
            np.testing.assert_allclose(found.states / x / scales.states, mine.states / scales.states, atol=ACCURACY)
            np.testing.assert_allclose(found.inputs / u / scales.inputs, mine.inputs / scales.inputs, atol=ACCURACY)
            assert np.all(np.abs(found.states[-1] - other.reference.values.states[-1]) / x < 1e-7 * scales.states)
        else:
            assert isinstance(mine, Infeasible)
            assert found.widening == pytest.approx(mine.widening, rel=ACCURACY)
            assert (found.quantity, found.at_step) == (mine.quantity, mine.at_step)
            np.testing.assert_allclose(found.fallback / u / scales.inputs, mine.fallback / scales.inputs, atol=ACCURACY)
            assert (found.terminal_error is None) == (mine.terminal_error is None)
            if mine.terminal_error is not None:
                missed = np.array([found.terminal_error / x, mine.terminal_error]) / scales.states
                np.testing.assert_allclose(missed[0], missed[1], atol=ACCURACY)
