"""Stages ask about samples as `learn_reference` does: gaps when they are read, outliers when they are learned from."""

import re
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pipeline import fit
from pipeline.experiments import Experiment, load_experiment
from pipeline.generate import generate, sampled_by
from pipeline.methods import Fit
from pipeline.storage.results import Results
from tests.pipeline.params import changed, written_to
from trackably import DoubtfulInputWarning, IgnoresSamplesWarning
from trackably.learning.problem import ConstrainedProblem, Solution
from trackably.learning.search import best_solution

TIMES = np.arange(60.0) * 4
LEVELS = 1.0 + 0.1 * np.sin(TIMES / 30) + 0.01 * np.random.default_rng(1).standard_normal(TIMES.size)


def tank(folder: Path, times: np.ndarray, levels: np.ndarray, line: str = "") -> Experiment:
    rows = "".join(f"{t!r},{level!r}\n" for t, level in zip(times.tolist(), levels.tolist(), strict=True))
    (folder / "tank.csv").write_text(f"t,x\n{rows}", encoding="utf-8")
    entry = changed(
        "tank",
        ("claim: all_times\n", f"claim: all_times\n    {line}\n"),
        ("samples_from: data/recordings/tank.mcap", f"samples_from: {folder}"),
        ("mcap: data/recordings/tank.mcap", f"csv: {folder / 'tank.csv'}"),
        ("topic: /tank/level", "time_column: t\n        time_unit: s"),
        ("field: level", "value_column: x"),
        ("{start: 0.0, end: 240.0, held_out: 60.0}", "{end: 3000.0}"),
    )
    return load_experiment("tank", written_to(folder, entry))


def learned(experiment: Experiment) -> Solution:
    samples = sampled_by(experiment).samples
    found = best_solution(ConstrainedProblem(samples, experiment.learned_prior, experiment.search_space(samples)))
    assert isinstance(found, Solution)
    return found


def asked(experiment: Experiment, solution: Solution) -> list[str]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        fit._ask(experiment, {"joint": Fit(solution), "unconstrained": Fit(learned(experiment))})
    assert {one.category for one in caught} <= {DoubtfulInputWarning, IgnoresSamplesWarning}
    return [str(one.message) for one in caught]


@pytest.mark.parametrize("line", ["", "centres: 30"])
def test_gaps_of_all_samples_are_asked_about(line: str, tmp_path: Path) -> None:
    """Centres that stand for samples have gaps of their own, and hide those of samples."""
    late = np.where(TIMES > 120, TIMES + 60, TIMES)
    with pytest.warns(
        DoubtfulInputWarning, match="experiment tank: samples: there is none of level for 64 s after 120 s"
    ):
        generate(tank(tmp_path, late, LEVELS, line), Results("tank", tmp_path))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        generate(tank(tmp_path, TIMES, LEVELS, line), Results("tank", tmp_path))


def test_an_outlier_is_asked_about_when_it_is_learned_from(tmp_path: Path) -> None:
    lost = LEVELS + 0.4 * (np.arange(60) == 20)
    experiment = tank(tmp_path, TIMES, lost)
    (said,) = asked(experiment, learned(experiment))
    assert re.match(r"experiment tank: samples: level is 1\.\d+ at 80 s, 0\.\d+ off the fit without bounds", said)
    ordinary = tank(tmp_path, TIMES, LEVELS)
    assert asked(ordinary, learned(ordinary)) == []
    fewer = tank(tmp_path, TIMES, lost, "centres: 30")
    assert asked(fewer, learned(fewer)) == []


def test_samples_that_are_ignored_are_told(tmp_path: Path) -> None:
    experiment = tank(tmp_path, TIMES, LEVELS)
    found = learned(experiment)
    flat = replace(found, signals=tuple(replace(of, weights=0 * of.weights) for of in found.signals))
    (said,) = asked(experiment, flat)
    assert said.startswith("experiment tank: the reference keeps its bounds but does not follow its samples")
