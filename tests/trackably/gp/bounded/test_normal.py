"""Draws between bounds: within them always, and distributed as a second way to draw says."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from trackably.gp.bounded import BoundedNormal, NoRoom, root

INF = np.inf


def between(rows, lower, upper) -> BoundedNormal:
    return BoundedNormal.between(*(np.asarray(given, dtype=float) for given in (rows, lower, upper)))


def random_rows(seed: int, most_rows: int = 12):
    """Rows through a polyhedron that holds one random point, and often not the origin."""
    rng = np.random.default_rng(seed)
    rows = rng.standard_normal((rng.integers(1, most_rows), rng.integers(1, 6))) * 10.0 ** rng.integers(-3, 4)
    rows[::4] = rows[-1]
    middle = rows @ (1.5 * rng.standard_normal(rows.shape[1]))
    size = np.linalg.norm(rows, axis=1) * rng.choice([0.3, 1.0, 3.0])
    return rows, middle - size * rng.uniform(0.1, 1, len(rows)), middle + size * rng.uniform(0.1, 1, len(rows))


# The last but two: a particle that is reflected with the period π/2 must not stay at 5.5.
@pytest.mark.parametrize(
    ("lower", "upper"), [(-1, 0.5), (2, 3), (-0.03, 0.02), (1, 1.05), (4, INF), (-INF, INF), (-INF, 0)]
)
def test_one_dimension_against_scipy(lower, upper):
    draws = between([[-2.0]], [-2 * upper], [-2 * lower]).draws(2000, 0)[:, 0]
    assert stats.kstest(draws, stats.truncnorm(lower, upper).cdf).pvalue > 0.01
    assert lower <= draws.min() < draws.max() <= upper


@pytest.mark.parametrize("seed", range(2))
def test_three_dimensions_against_rejection(seed):
    rng = np.random.default_rng(seed)
    rows = rng.standard_normal((8, 3))
    lower = -rng.uniform(0.1, 1.5, 8)
    upper = lower + rng.uniform(0.8, 3, 8)
    draws = between(rows, lower, upper).draws(2000, seed)
    every = rng.standard_normal((100_000, 3))
    kept = every[np.all((every @ rows.T >= lower) & (every @ rows.T <= upper), axis=1)]
    assert len(kept) > 1000
    for direction in np.vstack([np.eye(3), rows]):
        assert stats.ks_2samp(draws @ direction, kept @ direction).pvalue > 1e-3
    np.testing.assert_allclose(np.cov(draws.T), np.cov(kept.T), atol=0.1 * np.var(kept))


@given(st.integers(0, 10**6))
@settings(max_examples=12)
def test_every_draw_is_within_all_bounds(seed):
    rows, lower, upper = random_rows(seed)
    values = between(rows, lower, upper).draws(60, seed) @ rows.T
    assert np.all((values - lower) / np.linalg.norm(rows, axis=1) >= -1e-12)
    assert np.all((upper - values) / np.linalg.norm(rows, axis=1) >= -1e-12)


@pytest.mark.parametrize(
    ("rows", "lower", "upper"),
    [
        ([[1.0], [1.0]], [0, 2], [1, 3]),
        ([[1.0, 0], [0, 1.0], [1.0, 1.0]], [0, 0, -5], [1, 1, -0.1]),
        ([[0.0, 0.0]], [0.1], [1]),
        ([[1.0]], [0.5], [0.5]),
        ([[1.0]], [0.5], [0.50001]),
    ],
)
def test_where_nothing_is_between_the_bounds_nothing_is_drawn(rows, lower, upper):
    with pytest.raises(NoRoom):
        between(rows, lower, upper).draws(1, 0)


@given(st.integers(0, 10**6))
def test_a_root_is_one_in_any_units(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 9))
    half = rng.standard_normal((n, rng.integers(1, 9))) * 10.0 ** rng.integers(-6, 6, size=(n, 1))
    half[rng.integers(n)] *= rng.integers(2)
    covariance = half @ half.T
    found, std = root(covariance), np.sqrt(np.diag(covariance))
    assert found.shape[1] <= min(half.shape)
    assert np.all(np.abs(found @ found.T - covariance) <= 1e-10 * std * std[:, None])
