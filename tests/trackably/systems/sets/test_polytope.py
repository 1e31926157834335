"""Polytopes: interiors in all sizes and units, half-spaces, margins."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from trackably.systems.polytopes import Polytope


@pytest.mark.parametrize("size", [1e-300, 1e-12, 1e-3, 1.0, 1e9, 1e20, 1e100, 1e308])
def test_no_size_is_without_interior(size):
    """A bound that is never reached will do, whatever it is."""
    square = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, -1.0]])
    assert Polytope(square, np.full(4, -size), np.full(4, size)).depth == pytest.approx(0.5, abs=1e-6)
    flat = Polytope.box([-1.0, -size], [1.0, size])
    assert flat.widths[0] == 2.0
    assert flat.depth == pytest.approx(0.5, abs=1e-6)
    away = Polytope.box([size], [size * (1 + 1e-6)])
    assert away.depth == pytest.approx(0.5, abs=1e-6)


@st.composite
def polytopes(draw):
    """Around a point of their own, so that they have an interior."""
    n, r = draw(st.integers(1, 4)), draw(st.integers(1, 6))
    number = st.floats(-3, 3).map(lambda v: round(v, 2))
    rows = np.array(draw(st.lists(st.lists(number, min_size=n, max_size=n).filter(any), min_size=r, max_size=r)))
    inside = rows @ np.array(draw(st.lists(number, min_size=n, max_size=n)))
    down, up = (np.array(draw(st.lists(st.floats(0.01, 5), min_size=r, max_size=r))) for _ in range(2))
    return Polytope(rows, inside - down, inside + up)


@settings(max_examples=40)
@given(polytopes(), st.integers(0, 100), st.sampled_from([(), (3,), (2, 3)]))
def test_margins_are_distances_to_the_half_spaces(polytope, seed, shape):
    points = np.random.default_rng(seed).uniform(-5, 5, (*shape, polytope.dimension))
    H, h = polytope.inequalities
    np.testing.assert_allclose(polytope.margin(points), np.min(h - points @ H.T, axis=-1), atol=1e-12)


@settings(max_examples=40)
@given(polytopes(), st.lists(st.integers(-30, 30), min_size=4, max_size=4))
def test_the_depth_is_met_by_a_point_and_by_no_better_one_in_all_units(polytope, exponents):
    """A point that lies deeper would lie inside the set tightened by more."""
    units = 10.0 ** np.array(exponents[: polytope.dimension])
    polytope = Polytope(polytope.rows * units, polytope.lower, polytope.upper)
    assert not polytope.lower.flags.writeable
    width = polytope.upper - polytope.lower
    assert 0 < polytope.depth <= 0.5 + 1e-9
    for part, possible in ((0.999 * polytope.depth, True), (1.001 * polytope.depth + 1e-6, False)):
        if part < 0.5:
            tightened = polytope.rows, polytope.lower + part * width, polytope.upper - part * width
            if possible:
                Polytope(*tightened)
            else:
                with pytest.raises(ValueError, match="must have an interior"):
                    Polytope(*tightened)


@settings(max_examples=40)
@given(polytopes(), st.integers(0, 100))
def test_halfspaces_of_a_bounded_set_are_the_same_set(polytope, seed):
    """Written one side at a time, in any order, with a box around; compared by membership."""
    rng, n = np.random.default_rng(seed), polytope.dimension
    H, h = polytope.inequalities
    H, h = np.vstack([H, np.eye(n), -np.eye(n)]), np.concatenate([h, np.full(2 * n, 50.0)])
    order = rng.permutation(len(h))
    again = Polytope.halfspaces(H[order], h[order])
    points = rng.uniform(-6, 6, (200, n))
    inside = np.min(h - points @ H.T, axis=1)
    clear = np.abs(inside) > 1e-9
    np.testing.assert_array_equal((again.margin(points) > 0)[clear], (inside > 0)[clear])
