"""dvc.yaml: stages in the order in which results are made, from all code and from the logs before them."""

import pytest

from tests.project import ROOT
from trackably.files import read_yaml

DVC = read_yaml(ROOT / "dvc.yaml")
STAGES = {name: stage.get("do", stage) for name, stage in DVC["stages"].items()}
READS = {  # logs that hold the experiment's parameters, from `generate` on
    "fit": {"samples"},
    "verify": {"fit"},
    "control": {"fit"},
    "figures": {"fit", "verification", "control"},
}


def outputs(stage):
    listed = [*stage.get("outs", ()), *stage.get("plots", ()), *stage.get("metrics", ())]
    return {path: about for entry in listed for path, about in entry.items()}


def logs(paths):
    return {path.rpartition("/")[2].removesuffix(".mcap") for path in paths if path.endswith(".mcap")}


@pytest.mark.parametrize("stage", STAGES)
def test_a_stage_depends_on_all_code_and_on_the_logs_that_it_reads(stage):
    deps = STAGES[stage]["deps"]
    assert {"pipeline", "trackably"} <= {*deps}
    assert logs(deps) == READS.get(stage, set())
    assert ("params.yaml" in deps) == (stage == "generate")


@pytest.mark.parametrize("stage", STAGES)
def test_earlier_results_stay_until_a_stage_has_others(stage):
    assert all((about["cache"], about["persist"]) == (False, True) for about in outputs(STAGES[stage]).values())


def test_each_log_is_written_by_one_stage_before_those_that_read_it():
    written = set()
    for name, stage in STAGES.items():
        assert READS.get(name, set()) <= written
        new = logs([*outputs(stage)])
        assert not new & written
        written |= new
