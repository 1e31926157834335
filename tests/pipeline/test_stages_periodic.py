"""Example 2 through the stages: what they leave behind, the same bytes each time, and what the numbers have to say."""

import csv
import json
from functools import partial
from pathlib import Path

import pytest

from pipeline.drawings import experiment as chooser
from pipeline.experiments import load_experiment
from pipeline.storage.archive import read_fit
from pipeline.storage.results import Results
from tests.pipeline.params import changed, undisturbed, written_to
from tests.pipeline.stages import STAGES, is_shown, moved, refusal_of_fit, run_all_here, written
from tests.pipeline.stages import run_all as run_all_stages
from tests.pipeline.stages import run_here as run_stage_here
from tests.project import ROOT
from trackably.codec import dumps

run_all, run_here = (partial(f, experiment="example2") for f in (run_all_stages, run_stage_here))
METHODS = ("unconstrained", "grid", "intervals", "exact")
SHORT = changed(
    "example2",
    ("conservatism: [4, 8, 16, 32, 64, 128, 256], draws: 30", "conservatism: [8], draws: 1"),
    ("steps: 10000, shown: 400", "steps: 40, shown: 40, horizons: [2, 20]"),
    ("intervals: 16", "intervals: 8"),
    ("search: {starts: 16}", "search: {starts: 6}"),
    text=undisturbed("example2"),
)
ONE_START = changed("example2", ("starts: 6", "starts: 1"), text=SHORT)
WITHOUT_STUDY = changed("example2", ("    study: {conservatism: [8], draws: 1}\n", ""), text=SHORT)


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return run_all_here(tmp_path_factory.mktemp("finished"), "example2", SHORT)


def test_stages_leave_what_they_promise(finished: Path) -> None:
    files = {f"figures/{name}.svg" for name in ("prediction", "growth", "margins", "conservatism")}
    files |= {f"figures/{name}.svg" for name in ("closed-loop", "cost", "infeasibility", "feasible-set")}
    files |= {
        "control.mcap",
        "control.json",
        "samples.mcap",
        "fit.mcap",
        "iterations.csv",
        "verification.mcap",
        "metrics.json",
        "environment.json",
        "margins.csv",
        "summary.json",
        "scene.mcap",
        "layout.json",
    }
    files |= {f"certificates/{method}.json" for method in ("intervals", "exact", "hyperparameters", "joint")}
    files |= {f"certificates/{method}.counterexample.json" for method in ("unconstrained", "grid")}
    assert written(finished).keys() == {f"example2/{name}" for name in files}


def test_running_again_writes_the_same_bytes(finished: Path, tmp_path: Path) -> None:
    """Also with other numbers of BLAS threads and another hash seed; wall clocks go elsewhere.

    Loops and figures depend on nothing that they do not in Example 1, where they are closed and drawn twice.
    """
    written_to(tmp_path, SHORT)
    done = run_all(tmp_path, stages=STAGES[:3], PYTHONHASHSEED="7", OPENBLAS_NUM_THREADS="2")
    assert (done.returncode, done.stderr) == (0, ""), done.stderr
    again, before = written(tmp_path), written(finished)
    assert again == {name: before[name] for name in again}
    assert before.keys() - again.keys() == {name for name in before if is_shown(name) or "/control." in name}


def test_rounding_moves_results_within_tolerance_only(finished: Path, tmp_path: Path) -> None:
    """Other BLAS kernels, where there are others, and samples whose noise is larger by a few rounding errors."""
    text = changed("example2", ("noise_std: 0.3\n", f"noise_std: {0.3 * (1 + 1e-14)!r}\n"), text=WITHOUT_STUDY)
    written_to(tmp_path, text)
    done = run_all(tmp_path, stages=("generate", "fit", "verify"), OPENBLAS_CORETYPE="Prescott")
    assert done.returncode == 0, done.stderr
    assert [row for row in moved(finished, tmp_path) if row.topic != "attachment study.json"] == []


def test_metrics_of_the_four_methods(finished: Path) -> None:
    metrics = json.loads((finished / "results/example2/metrics.json").read_text())
    assert tuple(metrics) == (*METHODS, "hyperparameters", "joint")
    wanted = {
        "signal_std",
        "lengthscale",
        "period",
        "nlml",
        "price",
        "misfit",
        "rmse",
        "worst_state_margin",
        "worst_input_margin",
        "fits",
    }
    for block in metrics.values():
        assert wanted <= block.keys()
        assert "seconds" not in block
    free, grid, intervals, exact = (metrics[method] for method in METHODS)
    assert free["nlml"] < grid["nlml"] < exact["nlml"] < intervals["nlml"]
    assert exact["nlml"] == pytest.approx(71.2587, abs=1e-3)
    assert free["worst_input_margin"] < grid["worst_input_margin"] < 0 < exact["worst_input_margin"]
    assert grid["worst_input_margin_at_steps"] >= 0
    assert grid["first_violated_step"] > 400
    assert exact["first_violated_step"] is None
    assert exact["proof"].startswith("proved for all real t")
    assert exact["rmse"] < free["rmse"]


def test_seconds_are_told_apart(finished: Path) -> None:
    seconds = json.loads((finished / "results/example2/timings.json").read_text())
    assert tuple(seconds) == (*METHODS, "hyperparameters", "joint", "control")
    assert all(seconds[method] > 0 for method in (*METHODS, "hyperparameters", "joint"))


def test_the_study_survives_its_log(finished: Path) -> None:
    study = read_fit(Results("example2", finished / "results")).study
    assert study is not None
    assert study.conservatism.counts.tolist() == [8]
    assert study.draws.seeds.tolist() == [0]
    assert dumps(study) == dumps(read_fit(Results("example2", finished / "results")).study)


def test_the_committed_rounds_end_feasible() -> None:
    with (ROOT / "data/results/example2/iterations.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["relative_margin"]) >= 0 for row in rows] == [False] * (len(rows) - 1) + [True]


def test_a_grid_shorter_than_a_period_is_refused(tmp_path: Path) -> None:
    text = changed("example2", ("periodic: {last_step: 400", "periodic: {last_step: 300"), text=SHORT)
    written_to(tmp_path, text)
    done = run_here("generate", tmp_path)
    assert done.returncode == 2
    assert "have to last at least one period" in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


def test_an_infeasible_problem_ends_as_in_example_1(tmp_path: Path) -> None:
    text = changed("example2", ("{lower: [-2.0], upper: [2.0]}", "{lower: [3.0], upper: [4.0]}"), text=ONE_START)
    said = refusal_of_fit(tmp_path, "example2", text)
    assert "no admissible equilibrium" in said
    assert "breaks the state bounds [3, 4]" in said


def test_a_period_of_whole_steps_allows_the_sampled_problem(tmp_path: Path) -> None:
    text = changed(
        "example2",
        ("starts: 6", "starts: 1"),
        ("kernel: {type: periodic}", "kernel: {type: periodic, period: 3.14}"),
        ("grid, intervals, exact, ", "exact, sound_intervals, sampled, "),
        text=WITHOUT_STUDY,
    )
    written_to(tmp_path, text)
    for stage in ("generate", "fit", "verify"):
        done = run_here(stage, tmp_path)
        assert done.returncode == 0, done.stderr
    results = Results("example2", tmp_path / "results")
    metrics = json.loads(results.metrics.read_text())
    assert tuple(metrics) == ("unconstrained", "exact", "sound_intervals", "sampled", "hyperparameters", "joint")
    assert metrics["sampled"]["first_violated_step"] is None
    assert metrics["sound_intervals"]["proof"].startswith("proved for all real t")
    assert metrics["sampled"]["nlml"] <= metrics["exact"]["nlml"] + 1e-6
    experiment = load_experiment("example2", tmp_path / "params.yaml")
    drawn = chooser._of_references(experiment, results, read_fit(results))
    for axes in drawn["margins"]().axes:
        assert any("sampled" in text.get_text() for text in axes.get_legend().get_texts())
