"""The dual's solver: Karush, Kuhn and Tucker's conditions, and rows that explain each other."""

from dataclasses import dataclass

import numpy as np
import pytest

from trackably.learning.joint.dual import DualSolution, solve_dual

SEEDS = range(40)


@dataclass(frozen=True)
class Program:
    """Rows L (r, dimension) of vectors δ, so that K = L Lᵀ, and demands d that some δ meets."""

    rows: np.ndarray
    demand: np.ndarray
    is_equation: np.ndarray

    @property
    def covariance(self) -> np.ndarray:
        return self.rows @ self.rows.T

    def solved(self) -> DualSolution:
        found = solve_dual(self.covariance, self.demand, self.is_equation)
        assert found is not None
        return found


def consistent(seed: int) -> Program:
    """One to fifteen rows of very different length; some are equations, some have no slack at the δ that meets all."""
    rng = np.random.default_rng(seed)
    count, equations = int(rng.integers(1, 16)), int(rng.integers(0, 4))
    rows = rng.normal(size=(count, count + 4)) * 10 ** rng.uniform(-3, 3, (count, 1))
    is_equation = np.arange(count) < equations
    slack = np.where(is_equation | (rng.random(count) < 0.4), 0.0, rng.exponential(size=count))
    size = np.linalg.norm(rows, axis=1)
    return Program(rows, rows @ rng.normal(size=count + 4) - slack * size, is_equation)


def crowded(seed: int) -> Program:
    """Rows of a smooth function at many close times: most are sums of others, up to rounding."""
    rng = np.random.default_rng(seed)
    t = np.sort(rng.uniform(0, 1, 25))
    nodes = np.linspace(-1, 2, 60)
    rows = np.exp(-((t[:, None] - nodes) ** 2) / 2)
    wanted = 1 + 0.3 * np.cos(3 * t + seed)
    return Program(rows, wanted, np.zeros(t.size, dtype=bool))


def assert_optimal(program: Program, found: DualSolution, tolerance: float) -> None:
    """δ = Σ λ_a L_a meets all demands; multipliers of bounds are not negative, and zero where there is slack."""
    size = np.linalg.norm(program.rows, axis=1)
    slack = (program.covariance @ found.multipliers - program.demand) / size
    multipliers = found.multipliers * size
    scale = np.max(np.abs(program.demand / size), initial=1.0)
    bounded = ~program.is_equation
    assert not found.contradicts
    assert np.all(multipliers[bounded] >= 0)
    assert np.min(slack[bounded], initial=0.0) >= -tolerance * scale
    np.testing.assert_allclose(slack[program.is_equation], 0.0, atol=tolerance * scale)
    assert np.max(np.abs(slack[multipliers != 0]), initial=0.0) <= tolerance * scale
    norm = found.multipliers @ program.covariance @ found.multipliers
    assert found.value == pytest.approx(norm, rel=tolerance, abs=tolerance * scale**2)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_multipliers_are_optimal(seed):
    program = consistent(seed)
    assert_optimal(program, program.solved(), 1e-8)


@pytest.mark.parametrize("seed", range(10))
def test_rows_that_explain_each_other_do_no_harm(seed):
    program = crowded(seed)
    assert np.linalg.cond(program.covariance) > 1e14
    assert_optimal(program, program.solved(), 1e-6)


def test_a_row_that_no_vector_moves():
    """A quantity that the samples determine, or that no process enters: it keeps its bounds, or contradicts them."""
    rows, flags = np.array([[0.0, 0.0], [1.0, 0.0]]), np.zeros(2, dtype=bool)
    kept = solve_dual(rows @ rows.T, np.array([-0.5, 2.0]), flags)
    assert (kept.value, kept.contradicts) == (pytest.approx(4.0), False)
    assert solve_dual(rows @ rows.T, np.array([0.5, 2.0]), flags).contradicts
