"""Quadratic programs over x ≥ 0: conditions of optimality, and the active-set method of SciPy."""

import numpy as np
import pytest

from trackably.learning.joint.dual import nonnegative_minimum


def gram(count: int, directions: int, seed: int, jitter: float = 1e-10) -> np.ndarray:
    """Inner products of rows of unit length; singular but for the jitter where there are fewer directions than rows."""
    rows = np.random.default_rng(seed).standard_normal((count, directions))
    rows /= np.linalg.norm(rows, axis=1, keepdims=True)
    return rows @ rows.T + jitter * np.eye(count)


PROGRAMS = {
    f"{count} rows in {directions} directions, demands {what}": (
        gram(count, directions, count),
        shift + np.random.default_rng(1).standard_normal(count),
    )
    for count, directions in ((1, 1), (6, 9), (60, 80), (60, 20), (200, 220))
    for what, shift in (("of both signs", 0.0), ("mostly met", -2.0), ("hardly ever met", 2.0))
}
programs = pytest.mark.parametrize("name", PROGRAMS)


@programs
def test_the_minimum_is_optimal_wherever_the_search_begins(name):
    """x ≥ 0, y = G x − b ≥ 0 and xᵀ y = 0, up to the rounding of G x."""
    G, b = PROGRAMS[name]
    for likely in (None, np.zeros(len(b), dtype=bool), np.ones(len(b), dtype=bool), b > 1):
        x = nonnegative_minimum(G, b, likely)
        y, rounding = G @ x - b, 1e-14 * (np.abs(x).sum() + np.abs(b).max())
        assert x.min() >= 0
        assert y.min() >= -rounding
        assert np.abs(x * y).max() <= rounding * max(x.max(), 1.0)
