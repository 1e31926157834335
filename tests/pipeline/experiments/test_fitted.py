"""Stages refuse what an earlier stage left of another experiment, or of this one before it was changed."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from pipeline.control import control
from pipeline.experiments import Experiment, load_experiment
from pipeline.experiments.load import read_fit_of
from pipeline.figures import drawings
from pipeline.storage.archive import read_margins
from pipeline.storage.results import Results
from pipeline.verify import verify
from tests.pipeline.committed import EXPERIMENTS
from tests.pipeline.params import changed, written_to
from tests.project import ROOT
from trackably.errors import InputError

COMMITTED = ROOT / "data" / "results"


@pytest.fixture
def results(tmp_path: Path) -> Results:
    shutil.copytree(COMMITTED / "tank", tmp_path / "results" / "tank")
    return Results("tank", tmp_path / "results")


@pytest.mark.parametrize("stage", [verify, control, drawings])
def test_references_of_another_system_are_refused(
    tmp_path: Path, results: Results, stage: Callable[[Experiment, Results], object]
) -> None:
    experiment = load_experiment("tank", written_to(tmp_path, changed("tank", ("outflow: 0.05", "outflow: 0.051"))))
    before = {path: path.read_bytes() for path in results.folder.rglob("*.*")}
    with pytest.raises(
        InputError, match=r"fit\.mcap: unconstrained was learned for another system, .*pipeline fit tank"
    ):
        stage(experiment, results)
    assert {path: path.read_bytes() for path in results.folder.rglob("*.*")} == before


def test_units_are_no_part_of_the_system(tmp_path: Path, results: Results) -> None:
    renamed = changed("tank", ("inflow: m³/s}", "inflow: l/s}"))
    assert read_fit_of(load_experiment("tank", written_to(tmp_path, renamed)), results).learned


def test_margins_of_other_references_are_refused(results: Results) -> None:
    fitted = read_fit_of(EXPERIMENTS["tank"], results)
    assert set(read_margins(results, fitted.learned)) == set(fitted.learned)
    shutil.copyfile(COMMITTED / "vehicle" / "verification.mcap", results.log("verification"))
    with pytest.raises(InputError, match="no margins of unconstrained, level; run the verify stage"):
        read_margins(results, fitted.learned)
