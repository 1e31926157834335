"""Where the optimiser says that it has converged, no step improves: multipliers exist, on the paper's second example.

Its constraints are curved and nearly parallel, so that penalties become high; rounding must not pass for progress, nor
for the lack of it.
"""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.optimize import nnls

from pipeline.baselines import all_phases
from pipeline.experiments import load_experiment
from pipeline.generate import sampled_by
from tests.project import ROOT
from tests.trackably.learning.searches import followed
from trackably.arrays import Array
from trackably.learning import exchange, sqp
from trackably.learning.problem import ConstrainedProblem, Solution
from trackably.learning.screening import screen

_ACTIVE = 1e-6
_MOST_EVALUATIONS = 150
Ends = list[tuple[Array, sqp.Minimum, int]]


@pytest.fixture
def ends(monkeypatch: pytest.MonkeyPatch) -> Ends:
    """Every local minimum that is found, with the active constraints, bounds of the box too, and the evaluations."""
    found: Ends = []
    minimise: Callable[..., sqp.Minimum | None] = sqp.minimise

    def noted(
        evaluate: Callable[[Array], sqp.Evaluation | None], start: Array, lower: Array, upper: Array, *options: object
    ) -> sqp.Minimum | None:
        points: list[Array] = []

        def counted(x: Array) -> sqp.Evaluation | None:
            points.append(x)
            return evaluate(x)

        end = minimise(counted, start, lower, upper, *options)
        if end is not None:
            box = np.eye(len(start))
            active = end.at.jacobian[end.at.slack < _ACTIVE], box[end.x <= lower + 1e-9], -box[end.x >= upper - 1e-9]
            found.append((np.vstack(active), end, len(points)))
        return end

    monkeypatch.setattr(sqp, "minimise", noted)
    monkeypatch.setattr(exchange, "_ROUGH", sqp.PRECISION)  # every program, not only the last one of a search
    return found


def test_multipliers_exist(ends: Ends) -> None:
    experiment = load_experiment("example2", ROOT / "params.yaml")
    (samples,), prior = sampled_by(experiment).samples, experiment.learned_prior
    assert experiment.periodic
    system, space = experiment.plant, experiment.search_space((samples,))
    problem = ConstrainedProblem((samples,), prior, space, all_phases(system, experiment.periodic.backoff))
    outcome = followed(problem, screen(problem, 16))
    assert isinstance(outcome, Solution)
    assert outcome.objective == pytest.approx(71.2587, abs=1e-4)
    assert len(ends) > 10
    for normals, end, evaluations in ends:
        assert end.converged
        assert evaluations <= _MOST_EVALUATIONS  # the penalty does not stay so high that steps are tiny
        assert end.at.violation == 0
        left = nnls(normals.T, end.at.gradient)[1] if len(normals) else np.linalg.norm(end.at.gradient)
        assert left < 1e-5 * np.linalg.norm(end.at.gradient) + 1e-4
