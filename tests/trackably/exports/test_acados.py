"""Arrays for acados: the shapes that its cost module documents, and a solver that is told of every stage."""

import numpy as np
import pytest

from tests.trackably.exports.references import EVERY

every = pytest.mark.parametrize("name", EVERY)


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
