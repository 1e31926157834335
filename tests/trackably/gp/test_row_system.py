"""Samples and rows together: the same products and solutions as with the dense covariance of the rows."""

import numpy as np
import pytest

from trackably.gp import row_system
from trackably.gp.joint import JointPosterior, JointPrior
from trackably.gp.kernels.base import Kernel, Sum
from trackably.gp.kernels.matern import Matern32, Matern52, Matern72
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.posterior import Posterior
from trackably.gp.prior import Prior
from trackably.gp.row_posterior import RowPosterior
from trackably.gp.row_system import RowSystem
from trackably.gp.rows import Rows, Terms
from trackably.gp.samples import Samples
from trackably.gp.stencil import POINT, Stencil

RNG = np.random.default_rng(5)
STEP, COUNT = 0.1, 90
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


@pytest.mark.parametrize("block", [1, 5, 48, 1000])
@pytest.mark.parametrize("stencil", STENCILS.values(), ids=STENCILS)
@pytest.mark.parametrize("kernel", KERNELS.values(), ids=KERNELS)
def test_it_does_what_dense_matrices_do(kernel, stencil, block, monkeypatch):
    monkeypatch.setattr(row_system, "_BLOCK", block)
    part, terms = posterior_of(kernel, stencil), rows_of(COUNT)
    system = RowSystem.of(part, terms, COUNT)
    assert system is not None
    joint = JointPosterior(JointPrior((part.prior,)), (part.samples,))
    dense = RowPosterior(joint, Rows(np.zeros(COUNT), (terms,)))
    K, multipliers, noise = dense.covariance, RNG.normal(size=COUNT), 10.0 ** RNG.uniform(-3, 1, COUNT)
    scale = np.max(np.abs(K))
    np.testing.assert_allclose(system.product(multipliers), K @ multipliers, atol=1e-11 * scale * COUNT)
    np.testing.assert_allclose(system.seen(multipliers), multipliers @ dense._across[0], atol=1e-11 * scale * COUNT)
    np.testing.assert_allclose(system.variances, np.diag(dense._kernels[0].among()), atol=1e-13 * scale)
    found = system.solver(noise)(multipliers)
    np.testing.assert_allclose(
        found, np.linalg.solve(K + np.diag(noise), multipliers), atol=1e-7 * np.max(np.abs(found))
    )


def test_other_kernels_and_rows_that_a_process_forgets_have_none():
    assert RowSystem.of(posterior_of(SquaredExponential(1.0, 1.0)), rows_of(COUNT), COUNT) is None
    assert RowSystem.of(posterior_of(Matern52(1.0, 0.05)), rows_of(COUNT), COUNT) is None


def test_what_is_not_positive_definite_has_no_solver():
    system = RowSystem.of(posterior_of(KERNELS["Matérn 5/2"]), rows_of(COUNT), COUNT)
    assert system.solver(np.full(COUNT, -1.0)) is None
