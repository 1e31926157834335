"""The starts of periodic problems: the most promising of many points, found without evaluating every bound."""

import numpy as np
import pytest

from tests.pipeline.published.test_periodic import PRIOR, SAMPLES, SPACE, SYSTEM
from tests.trackably.learning.searches import followed
from trackably.learning import screening
from trackably.learning.methods import all_phases
from trackably.learning.problem import ConstrainedProblem
from trackably.learning.screening import screened


def test_screened_starts_are_apart_inside_and_promising():
    problem = ConstrainedProblem((SAMPLES,), PRIOR, SPACE, all_phases(SYSTEM))
    points = np.array(screened(problem, 20))
    assert points.shape == (20, 3)
    assert np.all((points >= SPACE.log_lower - 1e-12) & (points <= SPACE.log_upper + 1e-12))
    for i, one in enumerate(points):
        for other in points[:i]:
            assert np.any(np.abs(one - other)[1:] > (0.3, 0.03))
    ends = [followed(problem, [point]).objective for point in points[:4]]
    assert min(ends) == pytest.approx(71.2587, abs=1e-3)


def _screened_one_by_one(problem: ConstrainedProblem, keep: int) -> list[np.ndarray]:
    """Every point with every amplitude, each by a posterior of its own; then sort."""
    name = problem.prior.learned.index("signal_std")
    size = np.sqrt(np.mean((SAMPLES.values - PRIOR.parts[0].mean) ** 2))
    amplitudes = size * np.geomspace(screening._LOWEST, 5.0, 48)
    amplitudes = np.clip(amplitudes, *[getattr(SPACE.bounds["signal_std"], side) for side in ("lower", "upper")])
    found = []
    for at in problem.space.points(screening._POINTS):
        tried = []
        for amplitude in amplitudes:
            point = at.copy()
            point[name] = np.log(amplitude)
            posterior = problem.posterior(point)
            phases = np.arange(24) / 24 * posterior.prior.hyperparameters["period"]
            of_each = [np.min(constraint.relative_margin(posterior, phases)) for constraint in problem.constraints]
            tried.append((-min(0.0, *of_each), posterior.negative_log_marginal_likelihood()[0], tuple(point)))
        found.append(min(tried))
    kept: list[np.ndarray] = []
    for _, _, point in sorted(found):
        if len(kept) < keep and all(np.any(np.abs(point - other)[1:] > (0.3, 0.03)) for other in kept):
            kept.append(np.array(point))
    return kept


@pytest.mark.parametrize(("lowest", "keep"), [(0.02, 3), (0.8, 40)])  # large amplitudes break bounds at many points
def test_screened_starts_are_those_of_a_search_one_by_one(lowest, keep, monkeypatch):
    monkeypatch.setattr(screening, "_POINTS", 60)
    monkeypatch.setattr(screening, "_LOWEST", lowest)
    problem = ConstrainedProblem((SAMPLES,), PRIOR, SPACE, all_phases(SYSTEM))
    starts, naive = screened(problem, keep), _screened_one_by_one(problem, keep)
    assert len(starts) == len(naive)
    np.testing.assert_allclose(starts, naive, atol=1e-12)
