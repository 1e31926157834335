"""Disturbance sets: support functions against vertices."""

import numpy as np
import pytest

from tests.trackably.systems.disturbance.instances import ALL
from tests.trackably.systems.disturbance.naive import exact_support, extremes
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
