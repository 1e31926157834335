"""The multipliers of an interior point method are those of the dense dual program."""

import numpy as np
import pytest

from tests.trackably.gp.test_row_system import KERNELS, STENCILS, posterior_of, rows_of
from tests.trackably.learning.joint.instances import ALL, solved
from trackably.gp import row_posterior
from trackably.gp.joint import JointPosterior, JointPrior
from trackably.gp.kernels.matern import Matern52
from trackably.gp.row_posterior import RowPosterior
from trackably.gp.row_system import RowSystem
from trackably.gp.rows import Rows, Terms
from trackably.learning.joint.dual import solve_dual
from trackably.learning.joint.exchange import exchange_bounds, no_places
from trackably.learning.joint.interior import interior_multipliers

COUNT = 120


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("stencil", STENCILS.values(), ids=STENCILS)
@pytest.mark.parametrize("kernel", KERNELS.values(), ids=KERNELS)
def test_it_finds_what_the_dense_program_finds(kernel, stencil, seed):
    part, terms = posterior_of(kernel, stencil), rows_of(COUNT)
    system = RowSystem.of(part, terms, COUNT)
    K = RowPosterior(
        JointPosterior(JointPrior((part.prior,)), (part.samples,)), Rows(np.zeros(COUNT), (terms,))
    ).covariance
    demand = np.sqrt(np.diag(K)) * np.random.default_rng(seed).normal(-1.0, 1.0, COUNT)
    dual = solve_dual(K, demand, np.zeros(COUNT, dtype=bool))
    found = interior_multipliers(system, demand)
    assert np.all(found >= 0)
    assert 0 < np.count_nonzero(found) < COUNT
    assert found @ demand == pytest.approx(dual.value, rel=1e-6)
    values = K @ found
    assert np.min(values - demand) > -1e-7 * np.max(np.abs(demand))
    np.testing.assert_allclose((values - demand)[found > 0], 0, atol=1e-7 * np.max(np.abs(demand)))


def test_bounds_that_the_mean_keeps_have_no_multipliers():
    system = RowSystem.of(posterior_of(KERNELS["Matérn 5/2"]), rows_of(COUNT), COUNT)
    assert not np.any(interior_multipliers(system, -np.ones(COUNT)))


def test_bounds_that_contradict_each_other_have_none():
    """At one time, at least 1 and at most −1."""
    times = np.array([1.0, 1.0, *np.linspace(2, 3, 50)])
    terms = Terms(times, np.array([1.0, -1.0, *np.ones(50)]), np.arange(52))
    system = RowSystem.of(posterior_of(Matern52(1.0, 2.0)), terms, 52)
    assert interior_multipliers(system, np.ones(52)) is None


@pytest.mark.parametrize("name", ["matern32", "matern52", "matern72", "unstable"])
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
