"""Experiments on systems with several states: from the command line, on recordings, and wrongly written."""

import json
from pathlib import Path

import numpy as np
import pytest

from pipeline.compare.claims import Claims
from pipeline.compare.comparison import compare
from pipeline.compare.model import Status, load_tolerances
from pipeline.experiments import Experiment, load_experiment
from pipeline.generate import sampled_by
from pipeline.record import record
from pipeline.storage.archive import Fitted, read_fit
from pipeline.storage.results import Results
from tests.pipeline.params import PARAMS, changed, undisturbed
from tests.pipeline.stages import run_all_here
from tests.project import ROOT
from trackably.checker import Proved, check
from trackably.errors import InputError
from trackably.exports.figures import svg, tracking
from trackably.systems.margins import margin_profile
from trackably.systems.reference import Reference

# Short loops: `make repro` runs them for as long as they are committed.
SHORT = (
    changed(
        "vehicle",
        (
            "    verification: {last_step: 240, instants_per_step: 20}\n",
            "    verification: {last_step: 240, instants_per_step: 20}\n"
            "    control: {steps: 15, logged: 15, shown: 15}\n",
        ),
        text=undisturbed("vehicle"),
    )
    .replace("      horizon: 6\n      shown: 100\n", "      horizon: 6\n      steps: 40\n      shown: 40\n")
    .replace("online: {first: 12, window: 8, every: 6}", "online: {first: 12, window: 8, every: 24}")
)
BREATHING = sorted((ROOT.parent / "shared" / "data" / "breathing").glob("*.csv"))


@pytest.fixture(scope="module", params=["vehicle", "tank"])
def finished(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Path]:
    """Samples to figures."""
    name = request.param
    return name, run_all_here(tmp_path_factory.mktemp("tracking"), name, SHORT) / "results"


def test_proved_references_keep_every_bound_and_the_other_does_not(finished: tuple[str, Path]) -> None:
    name, results = finished
    metrics = json.loads((results / name / "metrics.json").read_text())
    worst = {
        method: min(value for key, value in of.items() if key.endswith("_margin_at_steps"))
        for method, of in metrics.items()
    }
    assert worst["unconstrained"] < 0 <= min(worst["hyperparameters"], worst["joint"])
    assert metrics["unconstrained"]["first_violated_step"] is not None
    assert metrics["joint"]["first_violated_step"] is None
    assert metrics["joint"]["proof"].startswith("proved for all real t ≥ 0")
    assert "certainly breaks" in metrics["unconstrained"]["proof"]
    alone, joint = metrics["hyperparameters"], metrics["joint"]
    assert 0 < joint["price"] < alone["price"]
    assert joint["price"] == joint["objective"] - metrics["unconstrained"]["nlml"]
    assert sum(joint["price_by_bound"].values()) == pytest.approx(joint["objective"] - joint["nlml"], rel=1e-12)
    assert alone["nlml"] == alone["objective"]
    assert joint["misfit"] < alone["misfit"]


def test_its_certificate_is_proved_by_the_checker(finished: tuple[str, Path]) -> None:
    name, results = finished
    assert isinstance(check(json.loads((results / name / "certificates/joint.json").read_text())), Proved)


def test_the_system_goes_where_the_stored_reference_goes(finished: tuple[str, Path]) -> None:
    name, results = finished
    reference = read_fit(Results(name, results)).learned["joint"].reference
    states, inputs = reference.state(np.arange(2001)), reference.input(np.arange(2000))
    np.testing.assert_allclose(reference.plant.system.successor(states[:-1], inputs), states[1:], atol=1e-9)


def test_rounds_of_fit_and_proof_are_written_down(finished: tuple[str, Path]) -> None:
    name, results = finished
    header, *rows = (results / name / "iterations.csv").read_text().splitlines()
    assert header == "round,backoff,objective,proved"
    assert rows[-1].endswith(",1")


def test_recordings_are_those_of_their_code(tmp_path: Path) -> None:
    record(tmp_path)
    for path in sorted(tmp_path.iterdir()):
        assert path.read_bytes() == (ROOT / "data/recordings" / path.name).read_bytes(), path.name


def axis() -> Experiment:
    return load_experiment("robot-axis")


def test_what_is_learned_of_a_recording_and_what_is_held_out() -> None:
    sampled = sampled_by(axis())
    (learned,), (later,) = sampled.samples, sampled.held_out
    assert (sampled.names, sampled.held_out_names) == (("position",), ("position",))
    assert learned.times[0] >= 0
    assert learned.times[-1] <= 30.0 < later.times[0]
    assert later.times[-1] <= 35.4
    assert np.median(np.diff(learned.times)) == pytest.approx(0.5, abs=0.02)
    assert np.median(learned.values) == pytest.approx(0, abs=1e-12)
    assert np.ptp(learned.values) == pytest.approx(12, abs=1.5)
    assert learned.stencil.weights == (0.5, 0.5)


@pytest.mark.skipif(not BREATHING, reason="the recordings of breathing are not part of the project")
@pytest.mark.parametrize("path", BREATHING, ids=lambda path: path.stem)
def test_real_recordings_take_the_place_of_the_simulated_one(path: Path, tmp_path: Path) -> None:
    """Nothing but the file changes, and what comes after is followed no worse than by the usual fit."""
    changed = undisturbed("robot-axis").replace("data/recordings/breathing.csv", str(path))
    run_all_here(tmp_path, "robot-axis", changed, stages=("generate", "fit"))
    results = Results("robot-axis", tmp_path / "results")
    fitted = read_fit(results)
    assert len(fitted.sampled.only) > 50
    assert results.iterations.read_text().splitlines()[-1].endswith(",1"), "proved in the end"
    joint, free = (fitted.learned[name].reference for name in ("joint", "unconstrained"))
    assert _held_out_rmse(fitted, joint) < 1.02 * _held_out_rmse(fitted, free)
    assert [quantity.name for quantity in joint.quantities] == ["position", "velocity", "acceleration"]
    assert all(margin_profile(joint, quantity, 5000, 1).worst[0] > 0 for quantity in joint.quantities)


def _held_out_rmse(fitted: Fitted, reference: Reference) -> float:
    (later,) = fitted.sampled.held_out
    return float(np.sqrt(np.mean((reference.state_at(later.times)[..., 0] - later.values) ** 2)))


def test_a_recording_with_german_dates_lost_values_and_a_line_of_units(tmp_path: Path) -> None:
    """The same motion as the guide's, written otherwise."""
    seconds, values = np.arange(40) * 0.05, 80 * np.cos(np.arange(40) * 0.05)
    rows = [f"02.03.2026 14:15:{s:06.3f};{v:.3f}".replace(".", ",") for s, v in zip(seconds, values, strict=True)]
    rows = [row.replace("02,03,2026", "02.03.2026") for row in rows]
    rows[7] = rows[7].split(";")[0] + ";LOST"
    (tmp_path / "axis.csv").write_text("\n".join(["stamp;z", "-;[mm]", *rows]), encoding="utf-8")
    written = PARAMS
    for old, new in (
        ("samples_from: data/recordings/breathing.csv", f"samples_from: {tmp_path}"),
        ("csv: data/recordings/breathing.csv", f"csv: {tmp_path / 'axis.csv'}"),
        ("time_column: Timestamp", "time_column: stamp"),
        ("time_unit: ms", 'time_unit: {date_format: "%d.%m.%Y %H:%M:%S", zone: "+01:00"}'),
        ("repairs: [drop_zero_rows, drop_rows_out_of_order, average_repeated]", "skip: [2]\n        missing: [LOST]"),
        ("{start: 0.0, end: 30.0, every: 0.5, held_out: 5.4, level: median}", "{end: 30.0}"),
    ):
        assert written.count(old) == 1, old
        written = written.replace(old, new)
    (tmp_path / "params.yaml").write_text(written, encoding="utf-8")
    experiment = load_experiment("robot-axis", tmp_path / "params.yaml")
    samples = sampled_by(experiment).only
    np.testing.assert_allclose(samples.times, np.delete(seconds, 7), atol=1e-12)
    np.testing.assert_allclose(samples.values, np.delete(values, 7), atol=5e-4)


@pytest.mark.parametrize(
    ("right", "wrong", "sentence"),
    [
        ("value_column: z", "value_column: w", "breathing.csv"),
        ("breathing.csv", "nothing.csv", "nothing.csv"),
        ('decimal: ","', 'decimal: "."', "breathing.csv"),
        ("[drop_zero_rows, drop_rows_out_of_order, average_repeated]", "[]", "average_repeated"),
    ],
)
def test_a_recording_that_is_not_as_written_is_refused(right: str, wrong: str, sentence: str, tmp_path: Path) -> None:
    path = tmp_path / "params.yaml"
    assert right in PARAMS
    path.write_text(PARAMS.replace(right, wrong), encoding="utf-8")
    experiment = load_experiment("robot-axis", path)
    with pytest.raises(InputError, match=sentence):
        sampled_by(experiment)


def redundant() -> str:
    """The vehicle with a second, weak drive along x."""
    changed = SHORT
    for old, new in (
        ("B: [[0, 0], [0, 0], [1, 0], [0, 1]]", "B: [[0, 0, 0], [0, 0, 0], [1, 0, 1], [0, 1, 0]]"),
        ("inputs: [ax, ay]", "inputs: [ax, ay, boost]"),
        (
            "      H: [[1, 1], [-1, -1], [1, -1], [-1, 1]]\n      h: [1.2, 1.2, 1.2, 1.2]\n",
            "      lower: [-0.5, -0.6, -0.1]\n      upper: [0.5, 0.6, 0.1]\n",
        ),
    ):
        assert changed.count(old) == 1, old
        changed = changed.replace(old, new)
    return changed


def test_redundant_inputs_from_samples_to_figures(tmp_path: Path) -> None:
    run_all_here(tmp_path, "vehicle", redundant(), stages=("generate", "fit", "verify"))
    fitted = read_fit(Results("vehicle", tmp_path / "results"))
    assert svg(tracking({name: found.reference for name, found in fitted.learned.items()}, {}, np.linspace(0, 12, 100)))
    reference = fitted.learned["joint"].reference
    assert [quantity.name for quantity in reference.quantities[-2:]] == ["ay", "ax+boost"]
    k = np.arange(3000)
    u = reference.input(k)
    assert np.min(reference.plant.input_set.margin(u)) > -1e-12
    assert np.max(np.abs(u[:, 0])) > 0.1, "more than both drives could do with the same input"
    assert isinstance(check(json.loads((tmp_path / "results/vehicle/certificates/joint.json").read_text())), Proved)
    metrics = json.loads((tmp_path / "results/vehicle/metrics.json").read_text())
    assert metrics["joint"]["worst_ax+boost_margin"] >= 0
    itself = compare(
        tmp_path / "results", tmp_path / "results", load_tolerances(ROOT / "tolerances.yaml"), Claims(claims=())
    )
    assert {row.status for row in itself.rows} == {Status.IDENTICAL}
