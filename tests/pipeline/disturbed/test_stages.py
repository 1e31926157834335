"""An experiment with a disturbance, from its parameters to the loops: what is learned, proved and counted."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from pipeline.disturbed import loops as runs
from pipeline.disturbed.loops import prices
from pipeline.experiments import load_experiment
from pipeline.storage.archive import read_fit
from pipeline.storage.loops import read_loops
from pipeline.storage.results import Results
from tests.pipeline.params import EXAMPLE1, changed, written_to
from tests.pipeline.stages import run_all_here
from trackably.checker import Proved, check
from trackably.control.controller import scaled_controller
from trackably.control.simulation import simulate
from trackably.control.tube import TubeController
from trackably.errors import InputError

ROBUST = ("robust", "robust_hyperparameters")
W = """disturbance:  # w of x(k+1) = A x(k) + B u(k) + w(k), and v of the measured state x(k) + v(k)
      lower: [-0.01]
      upper: [0.01]
      noise: {lower: [-0.005], upper: [0.005]}
      sizes: [0.5]
"""


def with_field(field: str, text: str = EXAMPLE1) -> str:
    return changed("example1", (W, f"{field}\n"), text=text)


@pytest.fixture(scope="module")
def finished(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("disturbed")
    short = changed(
        "example1",
        (
            "methods: [unconstrained, as_published, sound, hyperparameters, joint, robust]",
            "methods: [unconstrained, hyperparameters, joint, robust, robust_hyperparameters]",
        ),
        ("    study: {tightness: [0.05, 0.002]}\n", ""),
        ("    algorithm1: {first_step: 128, last_step: 300}\n", ""),
        (_online(), ""),
        ("shown: 30", "shown: 100"),
        text=EXAMPLE1,
    )
    return run_all_here(folder, "example1", short, ("generate", "fit", "verify", "control"))


def _online() -> str:
    found = re.search(r"      online:\n(?:        .*\n)+", EXAMPLE1)
    assert found
    return found[0]


def test_references_are_learned_within_the_tightened_bounds(finished):
    experiment = load_experiment("example1", finished / "params.yaml")
    fitted = read_fit(Results("example1", finished / "results"))
    left, given = experiment.tightening.plant.state_set, experiment.plant.state_set
    assert given.upper[0] == 0.05 > left.upper[0] + 0.0039
    for name in ROBUST:
        values = fitted.learned[name].reference.state(np.arange(300.0))
        assert np.all(left.margin(values) >= 0)


def test_certificates_say_it_and_the_checker_agrees(finished):
    for name in ROBUST:
        data = json.loads((finished / f"results/example1/certificates/{name}.json").read_text())
        verdict = check(data)
        assert isinstance(verdict, Proved)
        assert 'keep x in -2.0 ≤ "state" ≤ 0.05' in verdict.statement


def test_disturbed_loops_are_counted(finished):
    loops = json.loads((finished / "results/example1/control.json").read_text())["disturbed"]
    assert set(loops) == {"joint", "robust", "tube"}
    assert set(loops["joint"]) == set(loops["robust"]) == {"tube", "nominal"}
    for of in loops["robust"]["tube"].values():
        assert (of["steps"], of["steps_without_plan"], of["steps_outside"]) == (100, 0, 0)
    assert loops["joint"]["nominal"]["greedy"]["steps_outside"] > 0
    assert loops["joint"]["tube"]["drawn"]["steps_without_plan"] > 0
    assert loops["tube"] == {"runs": 300, "steps": 30000, "broken": 0}


def test_logs_hold_the_disturbed_loops(finished):
    """What the numbers say follows from the log; and runs of the formula are those of the controller."""
    experiment = load_experiment("example1", finished / "params.yaml")
    closed = read_loops(Results("example1", finished / "results"), experiment.plant).disturbed
    numbers = json.loads((finished / "results/example1/control.json").read_text())["disturbed"]
    for reference, of in closed.loops.items():
        for controller, by_kind in of.items():
            for kind, course in by_kind.items():
                said = numbers[reference][controller][kind]
                assert len(course.infeasible) == said["steps_without_plan"]
                assert np.min(experiment.plant.state_set.margin(course.states[1:])) == said["worst_state_margin"]
    many = closed.runs
    assert np.all((many.lowest <= many.single) & (many.single <= many.highest))
    assert many.single.shape == (9, 100, 2)


def test_a_run_is_that_of_the_tube_controller(finished):
    experiment = load_experiment("example1", finished / "params.yaml")
    drawn_in, reference = experiment.tightening, read_fit(Results("example1", finished / "results")).learned["robust"]
    course = runs._run(drawn_in, reference.reference.window(0, 40), 0, 4)
    nominal = scaled_controller(experiment.plant, 20)
    loop = simulate(
        TubeController(drawn_in, 20, nominal.Q, nominal.R),
        reference.reference,
        course[0, :1],
        40,
        disturbances=runs.disturbances("greedy" if 4 % 3 == 1 else "constant", drawn_in, 4),
        noise=runs.noise(drawn_in, 4),
    )
    np.testing.assert_allclose(np.column_stack([loop.states[:-1], loop.inputs]), course, atol=1e-12)


def test_the_price_of_room_rises_with_the_size_of_the_sets(finished):
    """Zero is the nominal reference, one the robust one; what lies between was learned for it."""
    price = json.loads((finished / "results/example1/control.json").read_text())["price_of_room"]
    metrics = json.loads((finished / "results/example1/metrics.json").read_text())
    assert price["sizes"] == [0.0, 0.5, 1.0]
    assert price["price"][::2] == [metrics[name]["price"] for name in ("joint", "robust")]
    assert price["misfit"][::2] == pytest.approx([metrics[name]["misfit"] for name in ("joint", "robust")], rel=1e-9)
    assert price["price"][0] < price["price"][1] < price["price"][2]
    assert price["largest"] > 1


def test_sizes_with_nothing_left_are_left_out(finished):
    experiment = load_experiment("example1", finished / "params.yaml")
    beyond = experiment.disturbance.model_copy(update={"sizes": (20.0,)})
    found = prices(
        experiment.model_copy(update={"disturbance": beyond}), read_fit(Results("example1", finished / "results"))
    )
    assert found["sizes"] == [0.0, 1.0]


def test_a_disturbance_without_a_robust_method_is_refused(tmp_path: Path) -> None:
    text = changed("example1", ("hyperparameters, joint, robust]", "hyperparameters, joint]"), text=EXAMPLE1)
    with pytest.raises(InputError, match="methods: expected robust among them where there is a disturbance"):
        load_experiment("example1", written_to(tmp_path, text))
    with pytest.raises(InputError, match="disturbance: is missing, but the method robust needs it"):
        load_experiment("example1", written_to(tmp_path, with_field("margin: 0.0")))


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
    experiment = load_experiment("example1", written_to(tmp_path, with_field(f"margin: 0.1\n    {W}")))
    assert experiment.plant.input_set.upper.tolist() == pytest.approx([0.4])
    assert experiment.tightening.plant.input_set.upper[0] < 0.4


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
        ("disturbance: {lower: [-0.01], upper: [0.01]}\n    margin: 0.5", r"margin: expected less than 0\.5"),
    ],
)
def test_what_is_wrong_ends_in_one_sentence(tmp_path: Path, field: str, words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        load_experiment("example1", written_to(tmp_path, with_field(field)))
    assert "\n" not in str(caught.value)
