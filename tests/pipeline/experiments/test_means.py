"""A prior mean that params.yaml leaves to be learned is the most likely one, and known from then on."""

from pathlib import Path

import pytest

from pipeline.experiments import load_experiment
from pipeline.experiments.model import with_learned_means
from pipeline.generate import sampled_by
from tests.pipeline.params import changed, written_to
from trackably.gp.samples import Samples
from trackably.learning.problem import ConstrainedProblem
from trackably.learning.search import best_solution


def tank(folder: Path, mean: str):
    return load_experiment("tank", written_to(folder, changed("tank", ("mean: 1.2,", f"mean: {mean},"), ("8}", "2}"))))


def least(experiment, samples: tuple[Samples, ...]) -> float:
    task = experiment.task(samples)
    return best_solution(ConstrainedProblem(samples, task.prior, task.space)).objective


def test_the_mean_is_learned_and_then_known(tmp_path: Path) -> None:
    experiment = tank(tmp_path, "[0.4, 1.24]")
    samples = sampled_by(experiment).samples
    assert experiment.learned_prior.parts[0].mean == pytest.approx(0.82)
    known = with_learned_means(experiment, samples)
    mean = known.prior["level"].mean
    assert 0.4 < mean < 1.24
    assert known.task(samples).prior.parts[0].mean == mean
    best = least(known, samples)
    for other in (mean - 0.05, mean + 0.05):
        assert least(tank(tmp_path, str(other)), samples) > best
    assert with_learned_means(known, samples) is known
