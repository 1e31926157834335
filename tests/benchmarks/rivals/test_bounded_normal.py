"""Draws between bounds: within them always, and distributed as a second way to draw says."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from benchmarks.rivals.adapters.bounded_normal import BoundedNormal, root
from benchmarks.rivals.model import NotFound

INF = np.inf


def between(rows, lower, upper) -> BoundedNormal:
    return BoundedNormal(*(np.asarray(given, dtype=float) for given in (rows, lower, upper)))


# The last but two: a particle that is reflected with the period π/2 must not stay at 5.5.
@pytest.mark.parametrize(
    ("lower", "upper"), [(-1, 0.5), (2, 3), (-0.03, 0.02), (1, 1.05), (4, INF), (-INF, INF), (-INF, 0)]
)
def test_one_dimension_against_scipy(lower, upper):
    draws = between([[-2.0]], [-2 * upper], [-2 * lower]).draws(2000, 0)[:, 0]
    assert stats.kstest(draws, stats.truncnorm(lower, upper).cdf).pvalue > 0.01
    assert lower <= draws.min() < draws.max() <= upper


@pytest.mark.parametrize("seed", range(4))
def test_three_dimensions_against_rejection(seed):
    """Rows in different units, some of them twice, through a polyhedron that often does not hold the origin."""
    rng = np.random.default_rng(seed)
    rows = rng.standard_normal((9, 3)) * 10.0 ** rng.integers(-3, 4, (9, 1))
    rows[::4] = rows[-1]
    size, middle = np.linalg.norm(rows, axis=1), rows @ (0.7 * rng.standard_normal(3))
    lower, upper = middle - size * rng.uniform(0.4, 1.5, 9), middle + size * rng.uniform(0.4, 1.5, 9)
    draws, every = between(rows, lower, upper).draws(2000, seed), rng.standard_normal((100_000, 3))
    room, of_every = (np.minimum(of @ rows.T - lower, upper - of @ rows.T) / size for of in (draws, every))
    assert np.min(room) >= -1e-12
    kept = every[np.min(of_every, axis=1) >= 0]
    assert len(kept) > 1000
    for direction in np.vstack([np.eye(3), rows]):
        assert stats.ks_2samp(draws @ direction, kept @ direction).pvalue > 1e-3
    np.testing.assert_allclose(np.cov(draws.T), np.cov(kept.T), atol=0.1 * np.var(kept))


@pytest.mark.parametrize(
    ("rows", "lower", "upper"),
    [
        ([[1.0], [1.0]], [0, 2], [1, 3]),
        ([[1.0, 0], [0, 1.0], [1.0, 1.0]], [0, 0, -5], [1, 1, -0.1]),
        ([[0.0, 0.0]], [0.1], [1]),
        ([[1.0]], [0.5], [0.50001]),
    ],
)
def test_where_nothing_is_between_the_bounds_nothing_is_drawn(rows, lower, upper):
    with pytest.raises(NotFound):
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
