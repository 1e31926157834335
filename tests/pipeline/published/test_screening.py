"""The starts of periodic problems: the most promising of many points, found without evaluating every bound."""

import numpy as np
import pytest

from pipeline.baselines import all_phases
from tests.pipeline.published.test_periodic import PRIOR, SAMPLES, SPACE, SYSTEM
from tests.trackably.learning.searches import followed
from trackably.learning.problem import ConstrainedProblem
from trackably.learning.screening import screen


def test_screened_starts_are_apart_inside_and_promising():
    problem = ConstrainedProblem((SAMPLES,), PRIOR, SPACE, all_phases(SYSTEM))
    points = np.array(screen(problem, 20))
    assert points.shape == (20, 3)
    assert np.all((points >= SPACE.log_lower - 1e-12) & (points <= SPACE.log_upper + 1e-12))
    for i, one in enumerate(points):
        for other in points[:i]:
            assert np.any(np.abs(one - other)[1:] > (0.3, 0.03))
    ends = [followed(problem, [point]).objective for point in points[:4]]
    assert min(ends) == pytest.approx(71.2587, abs=1e-3)
