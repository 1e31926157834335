"""The dual's solver: Karush, Kuhn and Tucker's conditions, and rows that no vector moves."""

import numpy as np
import pytest

from trackably.learning.joint.dual import solve_dual


@pytest.mark.parametrize("seed", range(40))
def test_the_multipliers_are_optimal(seed):
    """δ = Σ λ_a L_a meets all demands; multipliers of bounds are not negative, and zero where there is slack.

    One to fifteen rows L_a of very different length; some are equations, some have no slack at a δ that meets all.
    """
    rng = np.random.default_rng(seed)
    count, equations = int(rng.integers(1, 16)), int(rng.integers(0, 4))
    rows = rng.normal(size=(count, count + 4)) * 10 ** rng.uniform(-3, 3, (count, 1))
    is_equation, size = np.arange(count) < equations, np.linalg.norm(rows, axis=1)
    room = np.where(is_equation | (rng.random(count) < 0.4), 0.0, rng.exponential(size=count))
    demand = rows @ rng.normal(size=count + 4) - room * size
    found = solve_dual(rows @ rows.T, demand, is_equation)
    met = found.multipliers @ rows
    slack, tolerance = (rows @ met - demand) / size, 1e-8 * max(1.0, np.max(np.abs(demand / size)))
    assert not found.contradicts
    assert np.all(found.multipliers[~is_equation] >= 0)
    assert np.all(slack >= -tolerance)
    assert np.all(slack[is_equation | (found.multipliers != 0)] <= tolerance)
    assert found.value == pytest.approx(met @ met, rel=1e-8, abs=1e-8)


def test_a_row_that_no_vector_moves_keeps_its_bounds_or_contradicts_them():
    """A quantity that the samples determine, or that no process enters."""
    covariance, flags = np.diag([0.0, 1.0]), np.zeros(2, dtype=bool)
    kept = solve_dual(covariance, np.array([-0.5, 2.0]), flags)
    assert (kept.value, kept.contradicts) == (pytest.approx(4.0), False)
    assert solve_dual(covariance, np.array([0.5, 2.0]), flags).contradicts


def test_an_inexact_row_does_not_soften_exact_ones():
    """Row 9 is row 0 again, but rounding made its variance too small: K has no Cholesky factor.

    A common part added to the diagonal, large enough for this row, would lower the value by 9e-5 of itself.
    """
    t, free = np.linspace(0, 1, 9), np.zeros(10, dtype=bool)
    exact, demand = np.exp(-0.5 * (t[:, None] - t) ** 2 / 0.4**2), 1 + 0.3 * np.sin(9 * t)
    inexact = np.block([[exact, exact[:, :1]], [exact[:1], np.array([[1 - 5e-5]])]])
    rounding = np.append(np.zeros(9), 1e-4)
    alone = solve_dual(exact, demand, free[:9])
    found = solve_dual(inexact, np.append(demand, demand[0]), free, rounding=rounding)
    assert found.value == pytest.approx(alone.value, rel=1e-9)
