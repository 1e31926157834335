"""The multipliers of an interior point method are those of the dense dual program."""

import numpy as np
import pytest

from tests.trackably.learning.joint.instances import ALL, solved
from trackably.gp import row_posterior
from trackably.gp.joint import JointPosterior, JointPrior
from trackably.gp.kernels.base import Kernel, Sum
from trackably.gp.kernels.matern import Matern32, Matern52, Matern72
from trackably.gp.posterior import Posterior
from trackably.gp.prior import Prior
from trackably.gp.row_posterior import RowPosterior
from trackably.gp.row_system import RowSystem
from trackably.gp.rows import Rows, Terms
from trackably.gp.samples import Samples
from trackably.gp.stencil import POINT, Stencil
from trackably.learning.joint.dual import solve_dual
from trackably.learning.joint.exchange import exchange_bounds, no_places
from trackably.learning.joint.interior import interior_multipliers

RNG = np.random.default_rng(5)
STEP, COUNT = 0.1, 120
KERNELS = {
    "Matérn 3/2": Matern32(1.2, 0.8),
    "Matérn 5/2": Matern52(0.9, 1.5),
    "Matérn 7/2": Matern72(1.0, 3.0),
    "short": Matern52(1.0, 0.12),
    "sum": Sum(Matern32(0.7, 0.9), Matern52(1.0, 2.0)),
}
STENCILS = {"values": POINT, "differences": Stencil((-1.0, 1.0), STEP), "means": Stencil((0.25, 0.5, 0.25), STEP, 0.3)}


def rows_of(count: int) -> Terms:
    """Values, differences and second differences over up to two steps, at any times, in any order."""
    kinds = [[1.0], [-1.0, 1.0], [1.0, -2.0, 1.0]]
    chosen, first = RNG.integers(0, 3, count), RNG.permutation(np.linspace(-0.5, 5.5, count))
    terms = [
        (t + j * STEP, w, a) for a, (k, t) in enumerate(zip(chosen, first, strict=True)) for j, w in enumerate(kinds[k])
    ]
    times, weights, of_row = zip(*terms, strict=True)
    return Terms(np.array(times), np.array(weights), np.array(of_row))


def posterior_of(kernel: Kernel, stencil: Stencil = POINT) -> Posterior:
    times = np.sort(RNG.uniform(0, 5, 70))
    return Posterior(Prior(kernel, 0.1, 0.2), Samples(times, np.sin(times), np.exp(RNG.uniform(-1, 1, 70)), stencil))


@pytest.mark.parametrize("stencil", STENCILS.values(), ids=STENCILS)
@pytest.mark.parametrize("kernel", KERNELS.values(), ids=KERNELS)
def test_it_finds_what_the_dense_program_finds(kernel, stencil):
    part, terms = posterior_of(kernel, stencil), rows_of(COUNT)
    system = RowSystem.of(part, terms, COUNT)
    K = RowPosterior(
        JointPosterior(JointPrior((part.prior,)), (part.samples,)), Rows(np.zeros(COUNT), (terms,))
    ).covariance
    demand = np.sqrt(np.diag(K)) * np.random.default_rng(0).normal(-1.0, 1.0, COUNT)
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
