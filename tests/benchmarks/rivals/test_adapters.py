import numpy as np
import pytest

from benchmarks.rivals.adapters.truncated import Truncated, conditioned, hats
from trackably.gp.bounded import least_norm
from trackably.gp.kernels.matern import Matern52


def toy(count: int) -> Truncated:
    """y = 1/(1 + exp(−10 (x − 1/2))) at 0.1, 0.4 and 0.8, without noise; in [0, 1] and monotone."""
    knots, x = np.linspace(0, 1, count), np.array([0.1, 0.4, 0.8])
    values = 1 / (1 + np.exp(-10 * (x - 0.5)))
    covariance = Matern52(signal_std=1.0, lengthscale=0.4)(knots[:, None] - knots)
    rows = np.vstack([np.eye(count)[[0, -1]], np.diff(np.eye(count), axis=0)])
    mean, root = conditioned(covariance, np.full(count, 0.5), hats(x, knots), np.full(3, 1e-5), values)
    return Truncated(mean, root, rows, np.zeros(count + 1), np.ones(count + 1))


def walls(of: Truncated) -> tuple[np.ndarray, np.ndarray]:
    """N w + g ≥ 0 with rows of length one."""
    D, at = of.rows @ of.root, of.rows @ of.mean
    N, g = np.vstack([D, -D]), np.concatenate([at - of.lower, of.upper - at])
    lengths = np.linalg.norm(N, axis=1)
    return N / lengths[:, None], g / lengths


def by_rejection(of: Truncated, draws: int) -> np.ndarray:
    """The mean of those draws of the normal distribution that keep the bounds."""
    drawn = of.mean + np.random.default_rng(1).standard_normal((draws, of.root.shape[1])) @ of.root.T
    values = drawn @ of.rows.T
    return np.mean(drawn[np.all((values >= of.lower) & (values <= of.upper), axis=1)], axis=0)


def test_mode_and_mean_of_the_toy_problem_are_those_of_other_methods():
    """An active-set method, and draws that are rejected outside of the bounds."""
    of = toy(26)
    assert of.mode() == pytest.approx(of.mean + of.root @ least_norm(*walls(of)), abs=1e-4)
    assert toy(5).average(4000) == pytest.approx(by_rejection(toy(5), 200_000), abs=0.01)
