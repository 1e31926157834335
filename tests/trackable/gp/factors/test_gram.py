"""Half matrices in strips against whole ones, for sizes around the height of a strip; the factor made of them."""

import numpy as np
import pytest

from tests.trackable.gp import naive
from tests.trackable.gp.factors.factors import REPRESENTATIVES
from tests.trackable.gp.instances import over
from trackable.gp.factors.dense import Dense
from trackable.gp.factors.gram import gram
from trackable.gp.posterior import Posterior
from trackable.gp.prior import Prior
from trackable.gp.samples import Samples

SIZES = [1, 2, 64, 128, 129, 200]


def irregular(n):
    return np.sort(np.random.default_rng(n).uniform(0, n / 10, n))


def covariance_of(kernel):
    def covariance(r):
        jet, gradient = kernel.jet_and_gradient(r, 0)
        return jet[0], gradient[:, 0]

    return covariance


@over(REPRESENTATIVES)
@pytest.mark.parametrize("n", SIZES)
def test_strips_against_whole_matrices(kernel, n):
    times, rng = irregular(n), np.random.default_rng(7)
    c, square = rng.standard_normal(n), rng.standard_normal((n, n))
    upper, _, gradient = gram(times, covariance_of(kernel))
    whole, by_theta = covariance_of(kernel)(times[:, None] - times)
    np.testing.assert_array_equal(np.triu(upper), np.triu(whole))
    scale = np.max(np.abs(by_theta)) * n
    np.testing.assert_allclose(gradient.times(c) / scale, by_theta @ c / scale, atol=1e-14)
    symmetric = square + square.T
    reference = np.einsum("ij,pij->p", symmetric, by_theta)
    below_lost = np.where(np.tri(n, k=-1, dtype=bool), 1e3, symmetric)
    np.testing.assert_allclose(gradient.traces(below_lost) / scale, reference / scale, atol=1e-12)


@over(REPRESENTATIVES)
@pytest.mark.parametrize("n", SIZES)
def test_the_factor_solves_and_has_the_determinant(kernel, n):
    times = irregular(n)
    variances = 0.3**2 * kernel(np.zeros(())) * np.linspace(0.5, 2, n)
    dense = Dense.of(times, covariance_of(kernel), variances)
    whole = kernel(times[:, None] - times) + np.diag(variances)
    right = np.random.default_rng(3).standard_normal((n, 2))
    np.testing.assert_allclose(whole @ dense.solve(right), right, atol=1e-11)
    np.testing.assert_allclose(whole @ dense.solve(right[:, 0]), right[:, 0], atol=1e-11)
    assert dense.log_determinant == pytest.approx(np.linalg.slogdet(whole)[1], rel=1e-11, abs=1e-11)
    by_noise = (np.diag(np.linalg.inv(whole)) - right[:, 0] ** 2) @ variances
    assert dense.likelihood_traces(right[:, 0])[1] == pytest.approx(by_noise, rel=1e-9)
    np.testing.assert_allclose(whole @ dense.solve(right), right, atol=1e-11)  # the inverse has left the factor alone


@over(REPRESENTATIVES)
def test_likelihood_of_more_samples_than_a_strip_holds(kernel):
    times = irregular(129) / 2
    samples = Samples(times, np.sin(times))
    prior = Prior(kernel, 0.2 * float(kernel(np.zeros(()))) ** 0.5, 0.3).as_learned()
    value, gradient = Posterior(prior, samples).negative_log_marginal_likelihood()
    assert value == pytest.approx(naive.negative_log_marginal_likelihood(prior, samples), rel=1e-9)
    reference = naive.by_log_hyperparameters(
        lambda p: Posterior(p, samples).negative_log_marginal_likelihood()[0], prior
    )
    np.testing.assert_allclose(gradient, reference, atol=1e-6 * max(1, np.max(np.abs(reference))))
