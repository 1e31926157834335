"""Stages refuse what an earlier stage left of this experiment before its system was changed."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from pipeline.control import control
from pipeline.experiments import Experiment, load_experiment, parameters_of
from pipeline.figures import drawings
from pipeline.storage.archive import read_fit
from pipeline.storage.results import Results
from pipeline.verify import verify
from tests.pipeline.params import changed, written_to
from tests.project import ROOT
from trackably.errors import InputError


def results_of(folder: Path, params: Path) -> Results:
    shutil.copytree(ROOT / "data" / "results" / "tank", folder / "results" / "tank")
    return Results("tank", folder / "results", parameters_of("tank", params))


@pytest.mark.parametrize("stage", [verify, control, drawings])
def test_references_of_another_system_are_refused(
    tmp_path: Path, stage: Callable[[Experiment, Results], object]
) -> None:
    params = written_to(tmp_path, changed("tank", ("outflow: 0.05", "outflow: 0.051")))
    experiment, results = load_experiment("tank", params), results_of(tmp_path, params)
    before = {path: path.read_bytes() for path in results.folder.rglob("*.*")}
    with pytest.raises(InputError, match=r"fit\.mcap: was learned for another system than .*pipeline fit tank"):
        stage(experiment, results)
    assert {path: path.read_bytes() for path in results.folder.rglob("*.*")} == before


def test_units_are_no_part_of_the_system(tmp_path: Path) -> None:
    params = written_to(tmp_path, changed("tank", ("inflow: m³/s}", "inflow: l/s}")))
    assert read_fit(results_of(tmp_path, params)).learned
