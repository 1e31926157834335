"""The dual's solver: Karush, Kuhn and Tucker's conditions, and rows that explain each other.

A program has rows L (r, dimension) of vectors δ, so that K = L Lᵀ, demands d that some δ meets, and flags of equations.
"""

import numpy as np
import pytest

from tests.trackably.gp.instances import over
from trackably.learning.joint.dual import solve_dual


def consistent(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """One to fifteen rows of very different length; some are equations, some have no slack at the δ that meets all."""
    rng = np.random.default_rng(seed)
    count, equations = int(rng.integers(1, 16)), int(rng.integers(0, 4))
    rows = rng.normal(size=(count, count + 4)) * 10 ** rng.uniform(-3, 3, (count, 1))
    is_equation = np.arange(count) < equations
    slack = np.where(is_equation | (rng.random(count) < 0.4), 0.0, rng.exponential(size=count))
    size = np.linalg.norm(rows, axis=1)
    return rows, rows @ rng.normal(size=count + 4) - slack * size, is_equation


def crowded(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows of a smooth function at many close times: most are sums of others, up to rounding."""
    t = np.sort(np.random.default_rng(seed).uniform(0, 1, 25))
    rows = np.exp(-((t[:, None] - np.linspace(-1, 2, 60)) ** 2) / 2)
    assert np.linalg.cond(rows @ rows.T) > 1e14
    return rows, 1 + 0.3 * np.cos(3 * t + seed), np.zeros(t.size, dtype=bool)


PROGRAMS = {f"consistent {seed}": (*consistent(seed), 1e-8) for seed in range(40)}
PROGRAMS |= {f"crowded {seed}": (*crowded(seed), 1e-6) for seed in range(10)}


@over(PROGRAMS, "rows", "demand", "is_equation", "tolerance")
def test_the_multipliers_are_optimal(rows, demand, is_equation, tolerance):
    """δ = Σ λ_a L_a meets all demands; multipliers of bounds are not negative, and zero where there is slack."""
    covariance, size = rows @ rows.T, np.linalg.norm(rows, axis=1)
    found = solve_dual(covariance, demand, is_equation)
    slack = (covariance @ found.multipliers - demand) / size
    scale = np.max(np.abs(demand / size), initial=1.0)
    assert not found.contradicts
    assert np.all(found.multipliers[~is_equation] >= 0)
    assert np.min(slack[~is_equation], initial=0.0) >= -tolerance * scale
    assert np.max(np.abs(slack[is_equation | (found.multipliers != 0)]), initial=0.0) <= tolerance * scale
    norm = found.multipliers @ covariance @ found.multipliers
    assert found.value == pytest.approx(norm, rel=tolerance, abs=tolerance * scale**2)


def test_a_row_that_no_vector_moves_keeps_its_bounds_or_contradicts_them():
    """A quantity that the samples determine, or that no process enters."""
    covariance, flags = np.diag([0.0, 1.0]), np.zeros(2, dtype=bool)
    kept = solve_dual(covariance, np.array([-0.5, 2.0]), flags)
    assert (kept.value, kept.contradicts) == (pytest.approx(4.0), False)
    assert solve_dual(covariance, np.array([0.5, 2.0]), flags).contradicts
