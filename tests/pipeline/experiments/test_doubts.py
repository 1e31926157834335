"""Stages ask about samples as `learn_reference` does: gaps when they are read, outliers when they are learned from."""

import warnings
from pathlib import Path

import numpy as np
import pytest

from pipeline.experiments import Experiment, load_experiment
from pipeline.generate import generate
from pipeline.storage.results import Results
from tests.pipeline.params import changed, written_to
from trackably import DoubtfulInputWarning

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
