"""The law of units: the same problem in other units has the same answer, in its own units."""

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest

from tests.trackably.control import instances
from tests.trackably.control.instances import NONLINEAR
from trackably.control.controller import Controller
from trackably.control.references import TabulatedReference
from trackably.control.stepping import Plan
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.nonlinear import NonlinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Window

FREE = (-np.inf, np.inf)


@dataclass(frozen=True, eq=False)
class Case:
    controller: Controller
    reference: TabulatedReference
    states: np.ndarray


def _case(controller: Controller, reference, states: list[list[float]]) -> Case:
    return Case(controller, TabulatedReference.of(reference, 0, controller.horizon), np.array(states))


def _integrator(*bounds: tuple[float, float]) -> Case:
    plant = instances.double_integrator(*bounds)
    states = [[1.0, 1.2], [0.5, 0.0], [1.2, 0.3], [0.0, 0.0]]
    return _case(instances.controller_of(plant), instances.at_rest(plant, 1.2), states)


CASES = {
    "integrator": _integrator(),
    "free position": _integrator(FREE),
    "free input": _integrator((-1.0, 1.2), (-2.0, 2.0), FREE),
    "nothing bounded": _integrator(FREE, FREE, FREE),
    "tank": _case(NONLINEAR["tank"].controller, NONLINEAR["tank"].reference, [[0.6], [0.85], [0.3], [0.0001]]),
}
UNITS = [(1e-12, 1e-12, 1.0), (1e-12, 1e12, 1e6), (3e8, 7e-9, 1e-9)]


def in_units(case: Case, x: np.ndarray, u: np.ndarray, cost: float) -> Case:
    """Return a case in which one former unit is `x` (n,), `u` (m,) and `cost` new ones."""
    old, values = case.controller, case.reference.values
    plant = ConstrainedSystem(
        _system(old.plant.system, x, u), _box(old.plant.state_set, x), _box(old.plant.input_set, u)
    )
    Q, R = cost * old.Q / np.outer(x, x), cost * old.R / np.outer(u, u)
    reference = TabulatedReference(0, Window(values.states * x, values.inputs * u))
    return Case(Controller(plant, old.horizon, Q, R), reference, case.states * x)


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


def answers(case: Case, x: np.ndarray, u: np.ndarray, cost: float) -> list[tuple]:
    """Return for each state what is said in words, the size of what is said, and states and inputs, in units."""
    found = []
    for state in case.states:
        answer = case.controller.step(0, state, case.reference)
        if isinstance(answer, Plan):
            found.append((answer.status, answer.cost / cost, answer.states / x, answer.inputs / u))
        else:
            missed = np.nan if answer.terminal_error is None else answer.terminal_error / x
            words = answer.quantity, answer.at_step
            found.append((words, answer.widening, missed, answer.fallback / u))
    return found


@cache
def answers_in_widths(name: str) -> list[tuple]:
    scales = CASES[name].controller.formulation.scales
    return answers(CASES[name], scales.states, scales.inputs, 1.0)


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize(("x", "u", "cost"), UNITS)
def test_the_same_problem_in_other_units_has_the_same_answer(name, x, u, cost):
    """Each state and each input has another unit; states and inputs are compared in widths of the sets."""
    case, scales = CASES[name], CASES[name].controller.formulation.scales
    units = x * 10.0 ** -np.arange(len(scales.states)), u * 10.0 ** np.arange(len(scales.inputs))
    found = answers(in_units(case, *units, cost), units[0] * scales.states, units[1] * scales.inputs, cost)
    for (words, size, *points), (other_words, other_size, *other_points) in zip(
        found, answers_in_widths(name), strict=True
    ):
        assert words == other_words
        assert size == pytest.approx(other_size, rel=1e-6)
        for point, other in zip(points, other_points, strict=True):
            np.testing.assert_allclose(point, other, rtol=0, atol=1e-6)
