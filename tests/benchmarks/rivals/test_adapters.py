import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import nnls

from benchmarks.rivals.adapters.rows import root
from benchmarks.rivals.adapters.truncated import conditioned, hats, most_likely
from trackably.gp.kernels.matern import Matern52


def test_the_mode_of_the_toy_problem_is_that_of_an_active_set_method():
    """y = 1/(1 + exp(−10 (x − 1/2))) at 0.1, 0.4 and 0.8, without noise; in [0, 1] and monotone."""
    knots, x = np.linspace(0, 1, 26), np.array([0.1, 0.4, 0.8])
    values = 1 / (1 + np.exp(-10 * (x - 0.5)))
    covariance = Matern52(signal_std=1.0, lengthscale=0.4)(knots[:, None] - knots)
    mean, F = conditioned(covariance, np.full(26, 0.5), hats(x, knots), np.full(3, 1e-5), values)
    rows = np.vstack([np.eye(26)[[0, -1]], np.diff(np.eye(26), axis=0)])
    D, at = rows @ F, rows @ mean
    normals, offsets = np.vstack([D, -D]), np.concatenate([at, 1 - at])
    active = nnls(np.vstack([normals.T, -offsets]), np.eye(27)[26])[0] > 0  # Lawson and Hanson, chapter 23
    nearest = np.linalg.lstsq(normals[active], -offsets[active])[0]
    assert most_likely(mean, F, rows, np.zeros(27), np.ones(27)) == pytest.approx(mean + F @ nearest, abs=1e-4)


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
