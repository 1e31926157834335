"""Disturbance sets: support functions against vertices, and vertices of half-spaces."""

import numpy as np
import pytest
import scipy

from tests.trackably.systems.disturbance.instances import ALL
from tests.trackably.systems.disturbance.naive import exact_support, extremes
from trackably.systems.disturbances import ConvexHull
from trackably.systems.rationals import exact


@pytest.mark.parametrize("name", ALL)
def test_the_support_function_is_the_largest_value_at_a_vertex(name):
    bounded = ALL[name].disturbance
    rows = np.random.default_rng(1).normal(size=(5, bounded.dimension))
    found = bounded.support(rows)
    for row, value in zip(rows, found, strict=True):
        assert value == pytest.approx(max(extremes(bounded) @ row), rel=1e-9, abs=1e-12)
        assert float(exact_support(bounded, exact(row))) == pytest.approx(value, rel=1e-12)
        assert bounded.farthest(row) @ row == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize("seed", range(2))
def test_halfspaces_have_the_support_of_their_linear_program(seed):
    rng = np.random.default_rng(seed)
    n = 2 + seed % 2
    H = np.vstack([np.eye(n), -np.eye(n), rng.normal(size=(3, n))])
    h = rng.uniform(0.5, 1.5, len(H))
    bounded = ConvexHull.halfspaces(H, h)
    for row in rng.normal(size=(5, n)):
        program = scipy.optimize.linprog(-row, A_ub=H, b_ub=h, bounds=(None, None))
        assert bounded.support(row) == pytest.approx(-program.fun, rel=1e-9)
    for vertex in bounded.vertices:
        assert np.all(exact(H) @ vertex <= exact(h))
