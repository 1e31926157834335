import numpy as np
import pytest
from scipy.interpolate import BSpline

from benchmarks.rivals.adapters import governor, splines, toppra_path, truncated
from benchmarks.rivals.adapters.truncated import Truncated, conditioned, hats
from benchmarks.rivals.model import Found, NotFound
from benchmarks.rivals.problems import problem
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
    of, x = toy(26), np.array([0.1, 0.4, 0.8])
    mode = of.mode()
    assert not isinstance(mode, NotFound)
    assert mode == pytest.approx(of.mean + of.root @ least_norm(*walls(of)), abs=1e-4)
    assert hats(x, np.linspace(0, 1, 26)) @ mode == pytest.approx(1 / (1 + np.exp(-10 * (x - 0.5))), abs=1e-3)
    assert toy(5).average(4000) == pytest.approx(by_rejection(toy(5), 200_000), abs=0.01)


def test_hat_functions_keep_the_bounds_between_their_knots():
    answer = truncated.solve(problem("example1"), "mode")
    assert isinstance(answer, Found)
    assert answer.curve.violation(problem("example1").window).most <= 1e-8
    assert not isinstance(truncated.solve(problem("tank"), "mode"), Found)


def test_the_bending_energy_is_that_of_quadrature():
    inner = np.linspace(0, 2, 9)
    knots = np.concatenate([[0.0] * 3, inner, [2.0] * 3])
    c = np.random.default_rng(0).standard_normal(len(knots) - 4)
    t = np.linspace(0, 2, 100_001)
    dense = np.trapezoid(BSpline(knots, c, 3).derivative(2)(t) ** 2, t)
    assert c @ splines._bending(knots, inner) @ c == pytest.approx(dense, rel=1e-6)


def test_a_spline_with_bounds_on_a_grid_leaves_them_between_its_times():
    answer = splines.solve(problem("axis"), 50)
    assert isinstance(answer, Found)
    violation = answer.curve.violation(problem("axis").window)
    assert 0 < violation.least <= violation.most < 0.05


def test_a_governor_keeps_the_bounds_at_every_step_and_holds_the_command_back():
    of = problem("example1")
    answer = governor.solve(of)
    assert isinstance(answer, Found)
    assert answer.curve.violation(of.window).is_none
    assert "held back at 0 " not in answer.says
    plant, steps = of.task.plant.linear, np.arange(301) * of.task.plant.sampling_time
    x, u = (signal(steps)[:, None] for signal in answer.curve.reference.signals)
    assert x[1:] == pytest.approx(x[:-1] @ plant.A.T + u[:-1] @ plant.B.T)


@pytest.mark.filterwarnings("ignore")
def test_toppra_is_faster_than_the_samples_and_breaks_a_bound_between_its_points():
    answer = toppra_path.solve(problem("axis"), 100)
    assert isinstance(answer, Found)
    assert answer.objective < 2.1
    assert 0 < answer.curve.violation((0.0, answer.last)).least < 0.05
