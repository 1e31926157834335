"""Durbin's recursion against dense inverses, and against a matrix whose inverse is known."""

import numpy as np
import pytest
from scipy.linalg import toeplitz

from tests.trackably.gp.factors.factors import REPRESENTATIVES
from tests.trackably.gp.instances import over
from trackably.gp.factors.toeplitz import durbin


@over(REPRESENTATIVES)
@pytest.mark.parametrize("n", [1, 2, 3, 40])
def test_first_column_of_the_inverse_and_determinant(kernel, n):
    column = kernel(0.07 * np.arange(n)) + 0.1 * kernel(np.zeros(())) * np.eye(1, n)[0]
    matrix = toeplitz(column)
    found = durbin(column)
    np.testing.assert_allclose(found.first_column, np.linalg.inv(matrix)[0], rtol=1e-10, atol=1e-12 / column[0])
    assert found.log_determinant == pytest.approx(np.linalg.slogdet(matrix)[1], rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("n", [2, 30, 3000])
@pytest.mark.parametrize("rho", [-0.9, 0.1, 0.999])
def test_a_first_order_process_by_hand(n, rho):
    """a_k = s ρᵏ has the tridiagonal inverse with first column (1, −ρ, 0, …)/(s (1 − ρ²)), and |A| = sⁿ (1 − ρ²)ⁿ⁻¹."""
    found = durbin(2.5 * rho ** np.arange(n))
    exact = np.zeros(n)
    exact[:2] = np.array([1, -rho]) / (2.5 * (1 - rho**2))
    np.testing.assert_allclose(found.first_column, exact, rtol=1e-11, atol=1e-11 * exact[0])
    assert found.log_determinant == pytest.approx(n * np.log(2.5) + (n - 1) * np.log1p(-(rho**2)), rel=1e-11)


@pytest.mark.parametrize(
    "column", [[0.0], [-1.0], [1.0, 1.0], [1.0, -1.5], [1.0, 0.9, 0.0], [np.nan, 0.0], [1.0, np.nan]]
)
def test_what_is_not_positive_definite_is_refused(column):
    assert durbin(np.array(column)) is None


def test_a_long_memory_of_nothing():
    """White noise: every reflection is negligible, and nothing is left but the diagonal."""
    found = durbin(np.append(4.0, 1e-40 ** np.arange(1, 6)))
    np.testing.assert_array_equal(found.first_column, [0.25, 0, 0, 0, 0, 0])
    assert found.log_determinant == pytest.approx(6 * np.log(4), rel=1e-15)
