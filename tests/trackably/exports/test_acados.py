"""Arrays for acados: the shapes that its cost module documents, and a solver that is told of every stage."""

import numpy as np
import pytest

from tests.trackably.exports.references import EVERY, all_times

every = pytest.mark.parametrize("name", EVERY)


class Recorded:
    """What an AcadosOcpSolver is told."""

    def __init__(self) -> None:
        self.told: dict[tuple[int, str], np.ndarray] = {}

    def set(self, stage: int, field: str, value: np.ndarray) -> None:
        self.told[stage, field] = value


@every
def test_each_stage_has_its_step(name: str) -> None:
    reference, horizon = EVERY[name](), 7
    system = reference.reference.plant.system
    n, m = len(system.states), len(system.inputs)
    sliding = reference.to_acados(horizon)
    for k in (0, 3):
        yref, yref_e = sliding.at(k)
        assert (yref.shape, yref_e.shape) == ((horizon, n + m), (n,))
        states, inputs = reference.window(k, horizon)
        np.testing.assert_array_equal(yref, np.hstack([states[:-1], inputs]))
        np.testing.assert_array_equal(yref_e, states[-1])


def test_a_solver_is_told_of_all_stages() -> None:
    solver, sliding = Recorded(), all_times().to_acados(5)
    sliding.set_in(solver, 2)
    yref, yref_e = sliding.at(2)
    assert list(solver.told) == [(stage, "yref") for stage in range(6)]
    for stage in range(5):
        np.testing.assert_array_equal(solver.told[stage, "yref"], yref[stage])
    np.testing.assert_array_equal(solver.told[5, "yref"], yref_e)
