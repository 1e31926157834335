"""The stages from outside: the command line, what it leaves behind, and what it says when it cannot go on."""

import csv
import json
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path

import pytest

from pipeline.storage.archive import read_fit, read_stage
from pipeline.storage.results import Results
from pipeline.storage.tables import read_columns, table_of_methods
from tests.pipeline.params import EXAMPLE1, PARAMS, changed, undisturbed, written_to
from tests.pipeline.stages import STAGES, drawn_here, is_shown, moved, run, run_all, run_all_here, run_here, written
from tests.project import ROOT
from trackably import __main__ as library

METHODS = ("unconstrained", "as_published", "sound", "hyperparameters", "joint")
SHORT = undisturbed("example1", EXAMPLE1)


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Example 1 from samples to figures, begun at k̄ = 128 to save time: the optimum is the same."""
    return run_all_here(tmp_path_factory.mktemp("finished"), "example1", SHORT)


def test_stages_leave_what_they_promise(finished: Path) -> None:
    figures = ["scheme", "tube", "asymptotic", "convergence", "prediction", "landscape", "margins", "tightness"]
    figures += ["closed-loop", "cost", "infeasibility", "feasible-set", "relearning"]
    files = ["samples.mcap", "fit.mcap", "iterations.csv", "environment.json", "verification.mcap", "metrics.json"]
    files += ["summary.json", "margins.csv", "control.mcap", "control.json", *(f"figures/{f}.svg" for f in figures)]
    files += [f"certificates/{name}.json" for name in METHODS[1:]]
    files += ["certificates/unconstrained.counterexample.json", "scene.mcap", "layout.json"]
    assert written(finished).keys() == {f"example1/{name}" for name in files}


def test_the_summary_tells_the_experiment(finished: Path) -> None:
    results = Results("example1", finished / "results")
    metrics, summary = (json.loads(path.read_text()) for path in (results.metrics, results.summary))
    assert len(summary) == 8
    for method in ("unconstrained", "joint"):
        assert summary[f"objective_{method}"] == metrics[method]["objective"]
        assert summary[f"rmse_{method}"] == metrics[method]["rmse"]
        margins = metrics[method]["worst_state_margin"] / 2.05, metrics[method]["worst_input_margin"] / 1.0
        assert summary[f"worst_relative_margin_{method}"] == pytest.approx(min(margins), rel=1e-12)
    assert summary["price_joint"] == summary["objective_joint"] - summary["objective_unconstrained"]
    assert 0 < 10 * summary["price_joint"] < summary["price_hyperparameters"]


def test_active_bounds_are_told_and_survive_their_log(finished: Path) -> None:
    """The state touches its upper bound once, where the unconstrained mean leaves it."""
    results = Results("example1", finished / "results")
    (active,) = read_fit(results).learned["joint"].active_bounds
    (topic,) = [series for series in read_stage(results, "fit").series if series.topic.startswith("/active_bounds/")]
    assert (active.name, active.side, topic.topic) == ("state", "upper", "/active_bounds/joint/state")
    assert topic.times.tolist() == [active.time] == pytest.approx([0.88], abs=0.05)
    assert {name: values.tolist() for name, values in topic.fields.items()} == {
        "side": [1.0],
        "multiplier": [active.multiplier],
        "price": [active.price],
    }
    metrics = json.loads(results.metrics.read_text())["joint"]
    assert metrics["price_by_bound"] == {"state (upper)": active.price}
    assert metrics["objective"] - metrics["nlml"] == pytest.approx(active.price, rel=1e-9)


def test_the_price_of_a_tighter_bound(finished: Path) -> None:
    """Hyperparameters alone lose their samples where the bound is tighter than their noise."""
    fitted = read_fit(Results("example1", finished / "results"))
    assert fitted.study is not None
    alone, joint = (fitted.study.tightness[name] for name in ("hyperparameters", "joint"))
    assert alone.uppers.tolist() == joint.uppers.tolist() == [0.05, 0.002]
    for of, name in ((alone, "hyperparameters"), (joint, "joint")):
        assert of.objectives[0] == pytest.approx(fitted.learned[name].objective, rel=1e-9)
        assert of.objectives[0] < of.objectives[1]
    assert 20 * joint.misfits[1] < alone.misfits[1]
    assert joint.errors[1] < 0.03 < alone.errors[1]


def test_a_table_shows_what_methods_cost(finished: Path) -> None:
    table = table_of_methods(Results("example1", finished / "results"))
    assert list(table.columns) == ["", "l", "J", "price", "misfit", "error to the truth", "proved"]
    assert [row[0] for row in table.rows] == [*METHODS]
    assert [row[-1] for row in table.rows] == [False, True, True, True, True]


def test_the_table_of_margins_has_the_smallest_of_each_method(finished: Path) -> None:
    results = Results("example1", finished / "results")
    table, summary = read_columns(results.margins), json.loads(results.summary.read_text())
    assert list(table) == ["time", *METHODS]
    assert (table["time"][0], len(table["time"])) == (0, 151)  # 301 sampling intervals, two in each row
    for method in ("unconstrained", "joint"):
        assert min(table[method]) == summary[f"worst_relative_margin_{method}"]


def test_metrics_hold_the_published_numbers(finished: Path) -> None:
    metrics = json.loads((finished / "results/example1/metrics.json").read_text())
    free, sound, published = metrics["unconstrained"], metrics["sound"], metrics["as_published"]
    assert (free["signal_std"], free["lengthscale"]) == pytest.approx((0.659325, 0.203472), abs=1e-5)
    assert free["nlml"] == pytest.approx(-3.855397, abs=1e-5)
    assert (free["first_violated_step"], free["last_violated_step"], free["final_step"]) == (77, 105, None)
    assert free["worst_state_margin"] == pytest.approx(0.05 - 0.0917, abs=1e-4)
    for found in (sound, published):
        assert (found["signal_std"], found["lengthscale"]) == pytest.approx((0.701178, 0.219672), abs=1e-5)
        assert found["nlml"] == pytest.approx(-3.716033, abs=1e-5)
        assert (found["first_violated_step"], found["last_violated_step"], found["final_step"]) == (None, None, 130)
        assert found["worst_state_margin_at_steps"] >= 0
        assert found["worst_input_margin"] > 0
        assert abs(found["smallest_defect"]) < 1e-7
        assert found["tail"]["state_margin"] > 0


def test_the_committed_trace_is_complete() -> None:
    with (ROOT / "data/results/example1/iterations.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    names = ["k_bar", "signal_std", "lengthscale", "mean_bound", "growth_lower", "growth_upper", "derivative_bound"]
    assert list(rows[0]) == names
    assert [int(row["k_bar"]) for row in rows] == list(range(70, 131))
    assert [row["k_bar"] for row in rows if not row["mean_bound"]] == [str(k) for k in range(70, 81)]
    assert float(rows[-1]["mean_bound"]) == pytest.approx(0.045841, abs=1e-5)


def test_running_again_writes_the_same_bytes(finished: Path, tmp_path: Path) -> None:
    """Also with other numbers of BLAS threads and another hash seed, and with a process for each stage and each core of
    its study: nothing that is in memory before a stage may reach its results.

    Of the figures those of loops, and one more: tests/pipeline/drawings/test_plots.py draws the others twice.
    """
    written_to(tmp_path, SHORT)
    for stage in STAGES[:-1]:
        done = run(stage, tmp_path, PYTHONHASHSEED="7", OPENBLAS_NUM_THREADS="2")
        assert (done.returncode, done.stdout, done.stderr) == (0, "", ""), done.stderr
    before = written(finished)
    assert written(tmp_path) == {name: content for name, content in before.items() if not is_shown(name)}
    again = drawn_here(
        tmp_path, "example1", "closed-loop", "cost", "infeasibility", "feasible-set", "relearning", "prediction"
    )
    assert again == {name: before[name] for name in again}


def test_rounding_moves_results_within_tolerance_only(finished: Path, tmp_path: Path) -> None:
    """Other BLAS kernels, where there are others, and noise that is larger by a rounding error."""
    text = changed(
        "example1",
        ("noise_std: 0.01}", f"noise_std: {0.01 * (1 + 1e-14)!r}}}"),
        ("    study: {tightness: [0.05, 0.002]}\n", ""),
        text=SHORT,
    )
    written_to(tmp_path, text)
    done = run_all(tmp_path, stages=("generate", "fit", "verify"), OPENBLAS_CORETYPE="Prescott")
    assert done.returncode == 0, done.stderr
    assert [row for row in moved(finished, tmp_path) if row.topic != "attachment study.json"] == []


FROM_A_FILE = """samples_from: data/paper/example1_samples.csv
    samples:
      state:
        csv: data/paper/example1_samples.csv
"""
REFUSED: Mapping[str, tuple[str, str, str]] = {
    "wrong type": ("A: [[0.9]]", "A: fast", "system.A"),
    "empty interval": ("{lower: [-0.5], upper: [0.5]}", "{lower: [0.5], upper: [0.5]}", "input_set"),
    "no such file": (FROM_A_FILE, FROM_A_FILE.replace("data/paper/example1_samples.csv", "none.csv"), "none.csv"),
    "no such column": ("value_column: y", "value_column: z", "'z'"),
}


@pytest.mark.parametrize(("right", "wrong", "names"), REFUSED.values(), ids=REFUSED)
def test_unusable_parameters_leave_earlier_results(
    right: str, wrong: str, names: str, finished: Path, tmp_path: Path
) -> None:
    before = written(finished)
    written_to(tmp_path, changed("example1", (right, wrong), text=SHORT))
    (tmp_path / "results").symlink_to(finished / "results")
    done = run_here("generate", tmp_path)
    assert done.returncode == 2
    assert names in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert written(finished) == before


def test_a_damaged_or_missing_log_is_one_sentence_that_names_it(finished: Path, tmp_path: Path) -> None:
    written_to(tmp_path, SHORT)
    done = run_here("fit", tmp_path)
    assert done.returncode == 2
    assert "samples.mcap: not there yet; `python -m pipeline generate example1` writes it" in done.stderr
    (tmp_path / "results/example1").mkdir(parents=True)
    whole = (finished / "results/example1/samples.mcap").read_bytes()
    for damaged in (whole[:-10], whole[:300] + bytes([whole[300] ^ 4]) + whole[301:], b""):
        (tmp_path / "results/example1/samples.mcap").write_bytes(damaged)
        done = run_here("fit", tmp_path)
        assert done.returncode == 2
        assert "samples.mcap" in done.stderr
        assert len(done.stderr.strip().splitlines()) == 1


def test_a_killed_stage_leaves_earlier_results(finished: Path, tmp_path: Path) -> None:
    written_to(tmp_path, PARAMS)
    (tmp_path / "results/example1").mkdir(parents=True)
    for name in ("samples.mcap", "fit.mcap", "iterations.csv"):
        (tmp_path / "results/example1" / name).write_bytes((finished / "results/example1" / name).read_bytes())
    before = written(tmp_path)
    command = [sys.executable, "-m", "pipeline", "fit", "example1", "--params", str(tmp_path / "params.yaml")]
    process = subprocess.Popen([*command, "--results", str(tmp_path / "results")], cwd=ROOT)
    time.sleep(2.0)
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert written(tmp_path) == before


def test_certificates_are_checked_on_the_command_line(
    finished: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def check(path: Path) -> int:
        return library.main(["check", str(path)])

    certificate = finished / "results/example1/certificates/joint.json"
    assert check(certificate) == 0
    proved = capsys.readouterr()
    assert (proved.out.startswith("For all real t ≥ 0"), proved.err) == (True, "")
    tighter = json.loads(certificate.read_text())
    tighter["reference"]["plant"]["state_set"]["upper"][0] = 0.049
    (tmp_path / "tighter.json").write_text(json.dumps(tighter))
    assert check(tmp_path / "tighter.json") == 1
    assert "does not prove" in capsys.readouterr().err
    for text in ("{}", "no JSON", json.dumps({**tighter, "more": 1})):
        (tmp_path / "none.json").write_text(text)
        assert check(tmp_path / "none.json") == 2
    assert check(tmp_path / "missing.json") == 2
    capsys.readouterr()
    assert check(certificate.with_name("unconstrained.counterexample.json")) == 4
    assert capsys.readouterr().out.startswith("NOT TRACKABLE: at t = 0.8")


def test_every_reference_says_what_is_proved_of_it(finished: Path) -> None:
    metrics = json.loads((finished / "results/example1/metrics.json").read_text())
    assert "certainly breaks [-2, 0.05]" in metrics["unconstrained"]["proof"]
    assert metrics["sound"]["proof"].startswith("proved for all sampled instants")
    for method in ("hyperparameters", "joint"):
        assert metrics[method]["proof"].startswith("proved for all real t ≥ 0")
