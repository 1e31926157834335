"""The control stage from outside, on a short run of Example 1: what it writes, says, and refuses."""

import json
from pathlib import Path

import numpy as np
import pytest

from pipeline.drawings.experiment import drawings
from pipeline.experiments import load_experiment
from pipeline.loops.initial_states import initial_states
from pipeline.methods import LearnedReference
from pipeline.storage.archive import Fitted, Sampled, write_fit
from pipeline.storage.loops import ClosedLoops, read_loops, table_of_loops, table_of_offers
from pipeline.storage.results import Results
from tests.pipeline.params import undisturbed
from tests.pipeline.stages import call, sketched, written
from trackably.control.controller import scaled_controller
from trackably.exports.figures import svg
from trackably.learning.problem import ConstrainedProblem
from trackably.learning.search import best_solution

SHORT = (
    undisturbed("example1")
    .replace("      steps: 10000\n", "      steps: 120\n      logged: 100\n      shown: 40\n      horizons: [2, 20]\n")
    .replace("last: 120, every: 10}, noise_std: 0.02, seed: 7", "last: 80, every: 10}, noise_std: 0.02, seed: 7")
)


def run(folder: Path, params: str = SHORT, example=None):
    """The stage, after a fit where an example is given."""
    (folder / "params.yaml").write_text(params, encoding="utf-8")
    if example:
        _fit(folder, example)
    return call("control", "example1", "--params", str(folder / "params.yaml"), "--results", str(folder / "results"))


def _fit(folder: Path, example) -> None:
    learning = example.learning
    free = best_solution(ConstrainedProblem(learning.samples, learning.prior, learning.space))
    learned = {
        name: LearnedReference.of(name, solution, learning.plant)
        for name, solution in (("unconstrained", free), ("joint", example.learned.solution))
    }
    write_fit(
        Results("example1", folder / "results"), Fitted(Sampled(("state",), learning.samples), learned, {}), TIMES
    )


TIMES = np.linspace(0, 1, 11)


@pytest.fixture(scope="module")
def finished(example1, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("control")
    done = run(folder, example=example1)
    assert (done.returncode, done.stdout) == (0, ""), done.stderr
    return folder


@pytest.fixture(scope="module")
def metrics(finished) -> dict:
    return json.loads((finished / "results/example1/control.json").read_text())


@pytest.fixture(scope="module")
def closed(finished) -> ClosedLoops:
    experiment = load_experiment("example1", finished / "params.yaml")
    return read_loops(Results("example1", finished / "results"), experiment.plant)


def test_the_metrics_say_what_happened(metrics):
    assert set(metrics) == {"horizon", "joint", "unconstrained", "interpolated", "online"}
    assert metrics["joint"]["first_untrackable_step"] is None
    assert metrics["unconstrained"]["first_untrackable_step"] == 77
    for start in ("on", "above", "below"):
        kept, lost = metrics["joint"][start], metrics["unconstrained"][start]
        assert (kept["steps"], kept["infeasible_steps"], kept["first_infeasible_step"]) == (120, 0, None)
        assert kept["largest_rise"] < 1e-12
        assert min(kept["worst_state_margin"], kept["worst_input_margin"]) >= 0
        assert (lost["infeasible_steps"], lost["first_infeasible_step"]) == (29, 57)
        assert "the state by" in lost["why"]
    assert metrics["joint"]["on"]["first_cost"] < 1e-20
    assert metrics["joint"]["above"]["first_cost"] > 0.1


def test_the_log_holds_what_the_metrics_count(metrics, closed):
    for reference, by_start in closed.courses.items():
        for start, course in by_start.items():
            assert np.array_equal(course.steps, np.arange(101.0))
            assert len(course.infeasible) == metrics[reference][start]["infeasible_steps"]
            np.testing.assert_allclose(
                0.9 * course.states[:-1] + 0.5 * course.inputs[:-1], course.states[1:], atol=1e-15
            )


def test_references_learned_again_are_logged_with_a_reason(metrics, closed):
    offers = metrics["online"]["offers"]
    assert [offer["step"] for offer in offers] == [30, 40, 50, 60, 70, 80]
    assert [offer["samples"] for offer in offers] == [[4], [5], [6], [6], [6], [6]]
    assert all(offer["reason"] for offer in offers)
    assert metrics["online"]["infeasible_steps"] == 0
    assert closed.offered["taken"].tolist() == [float(offer["taken"]) for offer in offers]
    assert closed.online.steps[-1] == 130


def test_feasible_sets_grow_with_the_horizon(closed):
    short, long = closed.feasible[2], closed.feasible[20]
    assert np.all(long["lower"] <= short["lower"] + 1e-9)
    assert np.all(long["upper"] >= short["upper"] - 1e-9)


def test_running_again_writes_the_same_bytes(finished, tmp_path, example1):
    done = run(tmp_path, example=example1)
    assert done.returncode == 0
    assert written(tmp_path) == written(finished)


def test_wall_clocks_are_kept_apart(finished):
    timings = json.loads((finished / "results/example1/timings.json").read_text())
    assert len(timings["control"]) == 9
    assert "seconds" not in (finished / "results/example1/control.json").read_text()


def test_the_figures_and_tables_can_be_shown(finished):
    results = Results("example1", finished / "results")
    drawn = drawings(load_experiment("example1", finished / "params.yaml"), results)
    of_references = {"margins", "tracking"}  # drawn from what other stages write, by their own tests
    loops = {name: draw for name, draw in drawn.items() if name not in of_references}
    assert set(loops) == {"closed-loop", "cost", "infeasibility", "feasible-set", "relearning"}
    with sketched():
        assert all(svg(draw()).startswith(b"<?xml") for draw in loops.values())
    assert len(table_of_loops(results).rows) == 9
    assert len(table_of_offers(results).rows) == 6


def test_without_a_fit_it_says_what_to_run(tmp_path):
    done = run(tmp_path)
    assert done.returncode == 2
    assert "fit.mcap: not there yet; `python -m pipeline fit example1` writes it" in done.stderr


@pytest.mark.parametrize(
    ("right", "wrong", "sentence"),
    [
        ("      steps: 120\n", "      steps: 0\n", "control.steps: expected"),
        ("        window: 6\n", "        window: some\n", "control.online.window: expected"),
        ("      steps: 120\n", "      step: 120\n", "control.step: is not a known field"),
    ],
)
def test_a_wrong_parameter_is_one_sentence(right, wrong, sentence, tmp_path):
    assert right in SHORT
    done = run(tmp_path, SHORT.replace(right, wrong))
    assert done.returncode == 2
    assert sentence in done.stderr
    assert done.stderr.count("\n") == 1


def test_samples_that_never_arrive_are_missed(tmp_path, example1):
    stream = SHORT.index("        stream: {")
    done = run(tmp_path, SHORT[:stream] + SHORT[SHORT.index("\n", stream) + 1 :], example1)
    assert done.returncode == 2
    assert "control.online: no samples of state arrive" in done.stderr


def test_starts_are_in_the_state_set_and_have_a_plan(example):
    controller = scaled_controller(example.learning.plant, 20)
    found = initial_states(controller, example.certified)
    assert list(found) == ["on", "above", "below"]
    for state in found.values():
        assert example.learning.plant.state_set.margin(state) >= 0
        assert type(controller.step(0, state, example.certified)).__name__ == "Plan"


def test_weights_count_parts_of_widths(example1):
    controller = scaled_controller(example1.learning.plant, 5, input_weight=3.0)
    np.testing.assert_allclose(controller.Q, [[1 / 2.05**2]])
    np.testing.assert_allclose(controller.R, [[3.0]])
