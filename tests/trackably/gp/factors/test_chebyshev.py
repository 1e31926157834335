"""Chebyshev points: as many as a covariance needs, and fewer centres of posterior means."""

import numpy as np
import pytest

from tests.trackably.gp.factors.factors import dense, factorisations, posterior_at, with_factor
from tests.trackably.gp.instances import over
from trackably.gp.factors.low_rank import Bases, LowRank
from trackably.gp.kernels.base import Product
from trackably.gp.kernels.matern import Matern32, Matern52
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.kernels.rational_quadratic import RationalQuadratic
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.stencil import POINT, Stencil

EVENLY = np.linspace(0.0, 7.0, 400)


@pytest.mark.parametrize("kernel", [Matern32(1.0, 5.0), Matern52(1.0, 5.0), SquaredExponential(1.0, 0.01)], ids=str)
def test_no_number_of_points_is_enough_for_others(kernel):
    assert Bases(EVENLY, np.ones(400), 7.0).points_for(kernel.value_and_gradient, 200) is None


@pytest.mark.parametrize("waves", [120, 127, 130, 200, 255, 257, 400])
def test_what_folds_back_onto_few_points_is_not_taken_for_resolved(waves):
    def cosine(r):
        values = np.cos(2 * np.pi * waves / EVENLY[-1] * r)
        return values, values[None]

    assert Bases(EVENLY, np.ones(400), 7.0).points_for(cosine, 256) is None


@over(
    {
        "rq": RationalQuadratic(1.0, 6.0, 1.0),
        "periodic": Periodic(1.0, 1.0, 7.0),
        "quasi_periodic": Product(SquaredExponential(1.0, 9.0), Periodic(1.0, 1.5, 6.0)),
    }
)
@pytest.mark.parametrize("stencil", [POINT, Stencil((1.0, -0.6), 0.05, 0.4), Stencil((1.0, 1.0), 40.0)], ids=str)
def test_fewer_centres_represent_the_posterior_mean(kernel, stencil):
    """The posterior mean as a sum of kernels at Chebyshev points, with its derivatives."""
    rng = np.random.default_rng(3)
    times, noise = 1e3 + np.sort(rng.uniform(0, 20, 400)), np.exp(rng.uniform(-0.5, 0.5, 400))
    posterior = posterior_at(kernel, times, 0.3, noise, stencil)
    whole, t = dense(posterior).signal, 1e3 + np.linspace(-5, 25, 300)
    condensed = with_factor(posterior, factorisations(posterior)[LowRank]).signal
    assert len(condensed.centres) <= len(whole.centres) / 2
    for one, other in zip(condensed.jet(t, 2), whole.jet(t, 2), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-9 * np.max(np.abs(other)))
