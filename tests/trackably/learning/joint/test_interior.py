"""Functions of an interior point method, for many rows, are those of the dense dual program."""

import numpy as np
import pytest

from tests.trackably.learning.joint.instances import ALL, solved
from trackably.gp import row_posterior
from trackably.learning.joint.exchange import exchange_bounds, no_places


@pytest.mark.parametrize("name", ["matern32", "matern52", "matern72", "unstable", "rough_axis"])
def test_functions_are_those_of_the_dense_program(name, monkeypatch):
    case, dense = ALL[name], solved(name)
    monkeypatch.setattr(row_posterior, "_MANY", 1)
    found = exchange_bounds(case.problem, case.posterior, no_places(case.problem))
    assert found.mean.given.system
    assert found.margin >= 0
    assert found.mean.price == pytest.approx(dense.mean.price, rel=1e-7)
    t = np.linspace(0, 3, 50)
    for one, other in zip(found.mean.signals, dense.mean.signals, strict=True):
        np.testing.assert_allclose(one(t), other(t), atol=1e-6)
