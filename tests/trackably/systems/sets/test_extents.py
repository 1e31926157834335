"""Extents of coordinates on sets whose rows they share."""

import numpy as np
import pytest
import scipy

from trackably.systems.polytopes import Polytope


@pytest.mark.parametrize("seed", range(8))
def test_extents_have_the_units_of_the_coordinates(seed):
    """Also where units differ by many orders, which solvers would take for zeros."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 5))
    rows, middle = np.vstack([np.eye(n), rng.normal(size=(2, n))]), rng.normal(size=n + 2)
    width = rng.uniform(0.5, 2.0, n + 2) + np.abs(middle - rows @ middle[:n])
    plain = Polytope(rows, middle - width, middle + width)
    units = 10.0 ** rng.uniform(-12, 12, n)
    scaled = Polytope(rows / units, middle - width, middle + width)
    for i in range(n):
        own, other = plain.extent(i), scaled.extent(i)
        np.testing.assert_allclose([other.lower, other.upper], units[i] * np.array([own.lower, own.upper]), rtol=1e-6)


def test_small_entries_of_a_row_count():
    assert Polytope([[1.0, 1e-10], [0.0, 1.0]], [-1.0, -1e12], [1.0, 1e12]).extent(0).upper == pytest.approx(101.0)


@pytest.mark.parametrize("seed", range(8))
def test_extents_are_those_of_a_program_without_units(seed):
    rng = np.random.default_rng(seed)
    rows, inside = rng.normal(size=(5, 3)), rng.normal(size=3)
    below, above = rng.uniform(0.1, 3.0, (2, 5))
    bounded = Polytope(rows, rows @ inside - below, rows @ inside + above)
    H, h = bounded.inequalities
    for i, direction in enumerate(np.eye(3)):
        least, most = (scipy.optimize.linprog(s * direction, H, h, bounds=(None, None)).x[i] for s in (1, -1))
        np.testing.assert_allclose([bounded.extent(i).lower, bounded.extent(i).upper], [least, most], atol=1e-6)
