"""Half matrices against whole ones, for even and odd sizes and around those of one part; the factor made of them."""

import numpy as np
import pytest

from tests.trackably.gp import naive
from tests.trackably.gp.factors.factors import REPRESENTATIVES
from tests.trackably.gp.instances import over
from trackably.gp.factors.dense import Dense
from trackably.gp.factors.factorisation import diagonal, differences, gram, packed, places, whole
from trackably.gp.posterior import Posterior
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples

SIZES = [1, 2, 3, 64, 127, 128, 201]  # up to 127 in one part


def irregular(n):
    return np.sort(np.random.default_rng(n).uniform(0, n / 10, n))


def covariance_of(kernel):
    def covariance(r):
        jet, gradient = kernel.jet_and_gradient(r, 0)
        return jet[0], gradient[:, 0]

    return covariance


def entries_of(kernel, times):
    apart = differences(times)
    return lambda part: covariance_of(kernel)(apart[part])


@pytest.mark.parametrize("n", range(1, 12))
def test_each_entry_is_stored_where_lapack_has_it(n):
    square = np.random.default_rng(n).standard_normal((n, n))
    matrix = square + square.T
    rows, columns = places(n)
    np.testing.assert_array_equal(packed(matrix), matrix[rows, columns])
    assert np.all(rows >= columns)
    np.testing.assert_array_equal(whole(n, packed(matrix)), matrix)
    np.testing.assert_array_equal(packed(matrix)[diagonal(n)], np.diag(matrix))
    np.testing.assert_array_equal(differences(square[0]), packed_lower(np.subtract.outer(square[0], square[0])))


def packed_lower(matrix):
    """The stored entries of the symmetric matrix that has this lower triangle."""
    lower = np.tril(matrix)
    return packed(lower + np.tril(lower, -1).T)


@over(REPRESENTATIVES)
@pytest.mark.parametrize("n", SIZES)
def test_parts_against_whole_matrices(kernel, n):
    times, rng = irregular(n), np.random.default_rng(7)
    c, square = rng.standard_normal(n), rng.standard_normal((n, n))
    entries, gradient = gram(n, entries_of(kernel, times))
    matrix, by_theta = covariance_of(kernel)(times[:, None] - times)
    np.testing.assert_allclose(whole(n, entries), matrix, atol=1e-15 * np.max(matrix))
    scale = np.max(np.abs(by_theta)) * n
    np.testing.assert_allclose(gradient.times(c) / scale, by_theta @ c / scale, atol=1e-14)
    symmetric = square + square.T
    reference = np.einsum("ij,pij->p", symmetric, by_theta)
    np.testing.assert_allclose(gradient.traces(n, packed(symmetric)) / scale, reference / scale, atol=1e-12)


@over(REPRESENTATIVES)
@pytest.mark.parametrize("n", SIZES)
def test_the_factor_solves_and_has_the_determinant(kernel, n):
    times = irregular(n)
    variances = 0.3**2 * kernel(np.zeros(())) * np.linspace(0.5, 2, n)
    dense = Dense.of(entries_of(kernel, times), variances)
    matrix = kernel(times[:, None] - times) + np.diag(variances)
    right = np.random.default_rng(3).standard_normal((n, 2))
    np.testing.assert_allclose(matrix @ dense.solve(right), right, atol=1e-11)
    np.testing.assert_allclose(matrix @ dense.solve(right[:, 0]), right[:, 0], atol=1e-11)
    assert dense.log_determinant == pytest.approx(np.linalg.slogdet(matrix)[1], rel=1e-11, abs=1e-11)
    by_noise = (np.diag(np.linalg.inv(matrix)) - right[:, 0] ** 2) @ variances
    assert dense.likelihood_traces(right[:, 0])[1] == pytest.approx(by_noise, rel=1e-9)
    np.testing.assert_allclose(matrix @ dense.solve(right), right, atol=1e-11)  # the inverse has left the factor alone


@pytest.mark.parametrize("n", [1, 2, 7, 8, 200])
def test_what_is_not_positive_definite_has_no_factor(n):
    indefinite = packed(np.eye(n) - 2 * np.outer(np.ones(n), np.ones(n)) / n)
    assert Dense.of(lambda part: (indefinite[part].copy(), np.zeros((1, indefinite[part].size))), np.zeros(n)) is None


@over(REPRESENTATIVES)
def test_likelihood_of_more_samples_than_a_part_holds(kernel):
    times = irregular(129) / 2
    samples = Samples(times, np.sin(times))
    prior = Prior(kernel, 0.2 * float(kernel(np.zeros(()))) ** 0.5, 0.3).as_learned()
    value, gradient = Posterior(prior, samples).negative_log_marginal_likelihood()
    assert value == pytest.approx(naive.negative_log_marginal_likelihood(prior, samples), rel=1e-9)
    reference = naive.by_log_hyperparameters(
        lambda p: Posterior(p, samples).negative_log_marginal_likelihood()[0], prior
    )
    np.testing.assert_allclose(gradient, reference, atol=1e-6 * max(1, np.max(np.abs(reference))))
