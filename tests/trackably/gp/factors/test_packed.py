"""Half matrices against whole ones, for even and odd sizes and around those of one part; the factor made of them."""

import numpy as np
import pytest

from tests.trackably.gp.instances import REPRESENTATIVE, over
from trackably.gp.factors.dense import Dense
from trackably.gp.factors.factorisation import differences

SIZES = [1, 2, 3, 64, 127, 128, 201]  # up to 127 in one part


def irregular(n):
    return np.sort(np.random.default_rng(n).uniform(0, n / 10, n))


def entries_of(kernel, times):
    apart = differences(times)
    return lambda part: kernel.value_and_gradient(apart[part])


@over(REPRESENTATIVE)
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
