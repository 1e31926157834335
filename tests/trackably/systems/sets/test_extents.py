"""Extents of coordinates on sets whose rows they share."""

import numpy as np
import pytest
import scipy

from trackably.systems.polytopes import Polytope


@pytest.mark.parametrize("seed", range(8))
def test_extents_are_those_of_a_program_without_units_in_the_units_of_the_coordinates(seed):
    """Also where units differ by many orders, which solvers would take for zeros."""
    rng = np.random.default_rng(seed)
    rows, inside = rng.normal(size=(5, 3)), rng.normal(size=3)
    below, above = rng.uniform(0.1, 3.0, (2, 5))
    plain = Polytope(rows, rows @ inside - below, rows @ inside + above)
    units = 10.0 ** rng.uniform(-12, 12, 3)
    scaled, (H, h) = Polytope(rows / units, plain.lower, plain.upper), plain.inequalities
    for i, direction in enumerate(np.eye(3)):
        ends = np.array([scipy.optimize.linprog(s * direction, H, h, bounds=(None, None)).x[i] for s in (1, -1)])
        for bounded, unit in ((plain, 1.0), (scaled, units[i])):
            extent = bounded.extent(i)
            np.testing.assert_allclose(np.array([extent.lower, extent.upper]) / unit, ends, rtol=1e-6, atol=1e-6)
