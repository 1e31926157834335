"""Stages from outside: the same bytes each time, and what they say and leave where they cannot go on."""

import json
import shutil
from pathlib import Path
from unittest import mock

import pytest

from pipeline.storage.results import Results
from tests.pipeline.command import call, refused
from tests.pipeline.params import EXAMPLE1, changed, undisturbed, written_to
from tests.pipeline.stages import (
    STAGES,
    drawn_here,
    is_shown,
    moved,
    run,
    run_all,
    run_all_here,
    run_here,
    written,
)
from tests.project import ROOT

SHORT = undisturbed("example1", EXAMPLE1)
PERIODIC = changed(
    "example2",
    ("intervals: 16", "intervals: 8"),
    ("search: {starts: 16}", "search: {starts: 6}"),
    text=undisturbed("example2"),
)


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Example 1 from samples to figures, begun at k̄ = 128 to save time: the optimum is the same."""
    return run_all_here(tmp_path_factory.mktemp("finished"), "example1", SHORT)


def test_stages_leave_the_files_that_are_committed(finished: Path) -> None:
    folder = ROOT / "data" / "results"
    committed = {path.relative_to(folder).as_posix() for path in (folder / "example1").rglob("*.*")}
    of_disturbances = {"certificates/robust.json", "figures/tube-of-runs.svg"}
    assert written(finished).keys() == committed - {f"example1/{name}" for name in of_disturbances}


def test_running_again_writes_the_same_bytes(finished: Path, tmp_path: Path) -> None:
    """Also with other numbers of BLAS threads and another hash seed, with a process for the fit and one for what
    follows: nothing that is in memory before a stage may reach its results.
    """
    written_to(tmp_path, SHORT)
    (tmp_path / "results/example1").mkdir(parents=True)
    shutil.copy(finished / "results/example1/samples.mcap", tmp_path / "results/example1")
    other = {"PYTHONHASHSEED": "7", "OPENBLAS_NUM_THREADS": "2"}
    for done in (run("fit", tmp_path, **other), run_all(tmp_path, STAGES[2:-1], **other)):
        assert (done.returncode, done.stdout, done.stderr) == (0, "", ""), done.stderr
    before = written(finished)
    assert written(tmp_path) == {name: content for name, content in before.items() if not is_shown(name)}
    again = drawn_here(tmp_path, "closed-loop", "prediction")
    assert again == {name: before[name] for name in again}


def test_rounding_moves_results_within_tolerance_only(finished: Path, tmp_path: Path) -> None:
    """Other BLAS kernels, where there are others, and noise that is larger by a rounding error."""
    written_to(tmp_path, changed("example1", ("noise_std: 0.01}", f"noise_std: {0.01 * (1 + 1e-14)!r}}}"), text=SHORT))
    done = run_all(tmp_path, STAGES[:3], OPENBLAS_CORETYPE="Prescott")
    assert done.returncode == 0, done.stderr
    assert moved(finished, tmp_path) == []


def test_a_damaged_or_missing_log_is_one_sentence_that_names_it(finished: Path, tmp_path: Path) -> None:
    written_to(tmp_path, SHORT)
    missing = "samples.mcap: not there yet; `python -m pipeline generate example1` writes it"
    refused(run_here("fit", tmp_path), missing)
    (tmp_path / "results/example1").mkdir(parents=True)
    whole = (finished / "results/example1/samples.mcap").read_bytes()
    (tmp_path / "results/example1/samples.mcap").write_bytes(whole[:-10])
    refused(run_here("fit", tmp_path), "samples.mcap")


def test_an_interrupt_has_its_exit_code_and_no_traceback(tmp_path: Path) -> None:
    with mock.patch("pipeline.generate.generate", side_effect=KeyboardInterrupt):
        done = call("generate", "example1", "--results", str(tmp_path))
    assert (done.returncode, done.stderr.strip()) == (130, "")


def test_a_grid_is_enough_where_the_period_is_known_and_has_whole_steps(tmp_path: Path) -> None:
    text = changed(
        "example2",
        ("starts: 6", "starts: 1"),
        ("kernel: {type: periodic}", "kernel: {type: periodic, period: 3.14}"),
        ("grid, intervals, exact, ", "exact, grid, "),
        text=PERIODIC,
    )
    results = Results("example2", run_all_here(tmp_path, "example2", text, STAGES[:3]) / "results")
    metrics = json.loads(results.metrics.read_text())
    assert tuple(metrics) == ("unconstrained", "exact", "grid", "hyperparameters", "joint")
    assert metrics["grid"]["first_violated_step"] is None
    assert metrics["grid"]["nlml"] <= metrics["exact"]["nlml"] + 1e-6


STREAM = next(line for line in SHORT.splitlines(keepends=True) if line.startswith("        stream: {"))
NOTHING_FOLLOWS = {
    "unusable parameters": ("generate", ("A: [[0.9]]", "A: fast"), "system: A"),
    "an empty problem": (
        "fit",
        ("{lower: [-2.0], upper: [0.05]}", "{lower: [-0.9], upper: [-0.5]}"),
        "breaks the state bounds [-0.9, -0.5] at t = ",
    ),
    "a loop that does not end": (
        "fit",
        ("first_step: 128, last_step: 300", "first_step: 128, last_step: 129"),
        "did not end",
    ),
    "a window shorter than the horizon": (
        "control",
        ("claim: all_times", "claim: {window: [0.0, 0.1]}"),
        "the window that is proved must be longer than the horizon, 20 steps",
    ),
    "samples that never arrive": ("control", (STREAM, ""), "control.online: no samples of state arrive"),
}


@pytest.mark.parametrize(("stage", "change", "said"), NOTHING_FOLLOWS.values(), ids=NOTHING_FOLLOWS)
def test_a_stage_that_cannot_go_on_says_why_and_leaves_what_was_there(
    stage: str, change: tuple[str, str], said: str, finished: Path, tmp_path: Path
) -> None:
    results, earlier = Results("example1", tmp_path / "results"), "fit" if stage == "control" else "samples"
    results.folder.mkdir(parents=True)
    shutil.copyfile(finished / f"results/example1/{earlier}.mcap", results.log(earlier))
    before = written(tmp_path)
    written_to(tmp_path, changed("example1", change, text=SHORT))
    refused(run_here(stage, tmp_path), said, code=1 if stage == "fit" else 2)
    assert written(tmp_path) == before
