"""An experiment with a disturbance, from its parameters to the loops: what is learned, proved and counted."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from pipeline.experiments import load_experiment
from pipeline.storage.archive import read_fit
from pipeline.storage.results import Results
from tests.pipeline.params import EXAMPLE1, changed, written_to
from tests.pipeline.stages import run_all_here
from trackable.checker import Proved, check
from trackable.errors import InputError

U = "input_set: {lower: [-0.5], upper: [0.5]}"


def with_field(field: str, text: str = EXAMPLE1) -> str:
    return changed("example1", (U, f"{U}\n    {field}"), text=text)


@pytest.fixture(scope="module")
def finished(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("disturbed")
    short = changed(
        "example1",
        (
            "methods: [unconstrained, as_published, sound, hyperparameters, joint]",
            "methods: [unconstrained, hyperparameters, joint]",
        ),
        ("    study: {tightness: [0.05, 0.002]}\n", ""),
        ("    algorithm1: {first_step: 128, last_step: 300}\n", ""),
        (_online(), ""),
        text=EXAMPLE1,
    )
    text = with_field("disturbance: {lower: [-0.004], upper: [0.004]}", short)
    return run_all_here(folder, "example1", text, ("generate", "fit", "verify", "control"))


def _online() -> str:
    found = re.search(r"      online:\n(?:        .*\n)+", EXAMPLE1)
    assert found
    return found[0]


def test_references_are_learned_within_the_tightened_bounds(finished):
    experiment = load_experiment("example1", finished / "params.yaml")
    fitted = read_fit(Results("example1", finished / "results"))
    left, given = experiment.plant.state_set, experiment.tightening.given.state_set
    assert given.upper[0] == 0.05 > left.upper[0] + 0.0039
    for name in ("hyperparameters", "joint"):
        values = fitted.learned[name].reference.state(np.arange(300.0))
        assert np.all(left.margin(values) >= 0)


def test_certificates_say_it_and_the_checker_agrees(finished):
    for name in ("hyperparameters", "joint"):
        data = json.loads((finished / f"results/example1/certificates/{name}.json").read_text())
        verdict = check(data)
        assert isinstance(verdict, Proved)
        assert 'keep x in -2.0 ≤ "state" ≤ 0.05' in verdict.statement


def test_disturbed_loops_are_counted(finished):
    loops = json.loads((finished / "results/example1/control.json").read_text())["disturbed"]
    assert set(loops) == {"drawn", "greedy", "constant"}
    for of in loops.values():
        assert (of["tube"]["steps"], of["tube"]["steps_without_plan"], of["tube"]["steps_outside"]) == (200, 0, 0)
    assert loops["greedy"]["nominal"]["steps_outside"] > 0


def test_every_form_of_a_set_is_read(tmp_path: Path) -> None:
    written = {
        "disturbance: {lower: [-0.01], upper: [0.01], feedback: [[-1.0]]}": "[-0.01, 0.01]",
        "disturbance: {H: [[1], [-1]], h: [0.01, 0.02]}": "a polytope with 2 vertices",
        "disturbance: {vertices: [[0.01], [-0.01]]}": "a polytope with 2 vertices",
        "disturbance: {centre: [0], generators: [[0.01]]}": "[-0.01, 0.01]",
    }
    for field, said in written.items():
        found = load_experiment("example1", written_to(tmp_path, with_field(field))).tightening.invariant
        assert str(found.disturbance) == said


def test_a_margin_draws_the_bounds_in(tmp_path: Path) -> None:
    experiment = load_experiment("example1", written_to(tmp_path, with_field("margin: 0.1")))
    assert experiment.plant.input_set.upper.tolist() == pytest.approx([0.4])


@pytest.mark.parametrize(
    ("field", "words"),
    [
        ("disturbance: {lower: [-0.01]}", r"disturbance: expected lower with upper, H with h, vertices, or centre"),
        ("disturbance: {lower: [-1], upper: [1], h: [1]}", r"disturbance: expected lower with upper"),
        ("disturbance: {lower: [1], upper: [-1]}", r"disturbance: needs finite bounds, lower ≤ upper"),
        ("disturbance: {lower: [-1], upper: [1]}", r"disturbance: the errors take .* of this disturbance set would do"),
        ("disturbance: {lower: [-1, 0], upper: [1, 0]}", r"must have an entry for each of 1 states, got 2"),
        (
            "disturbance: {lower: [-0.01], upper: [0.01], feedback: [[1]]}",
            r"inside the unit circle, but one has the size",
        ),
        ("disturbance: {push: 1}", r"disturbance\.push: is not a known field"),
        ("margin: 0.5", r"margin: expected less than 0\.5"),
    ],
)
def test_what_is_wrong_ends_in_one_sentence(tmp_path: Path, field: str, words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        load_experiment("example1", written_to(tmp_path, with_field(field)))
    assert "\n" not in str(caught.value)
