"""Committed results of every experiment: numbers, logs and proofs say the same of each other.

`make repro` shows that the code writes these results; what they have to say is tested here without running a stage.
"""

import json

import numpy as np
import pytest

from pipeline.loops import disturbed as runs
from pipeline.loops.trajectory import by_reference
from pipeline.storage.archive import read_stage
from pipeline.storage.logs import below
from pipeline.story import table_of_methods
from tests.pipeline.committed import BY_NAME, EXPERIMENTS, RESULTS, content, fitted, loops
from trackably.checker import Proved, Refuted, check
from trackably.control.controller import Controller
from trackably.control.simulation import simulate
from trackably.control.tube import TubeController

DISTURBED = pytest.mark.parametrize("name", [name for name, of in EXPERIMENTS.items() if of.disturbance])


@BY_NAME
def test_what_is_proved_keeps_every_bound_and_the_unconstrained_fit_does_not(name: str) -> None:
    metrics = content(RESULTS[name].metrics)
    for method, of in metrics.items():
        worst = min(value for key, value in of.items() if key.startswith("worst_") and key.endswith("_at_steps"))
        if of["proof"].startswith("proved for"):
            assert worst >= 0, method
            assert of["first_violated_step"] is None, method
        else:
            assert "certainly breaks" in of["proof"], method
            assert of["first_violated_step"] is not None, method
    assert "certainly breaks" in metrics["unconstrained"]["proof"]
    assert metrics["joint"]["proof"].startswith("proved for all real t")


@BY_NAME
def test_prices_are_differences_of_objectives_and_sums_over_bounds(name: str) -> None:
    metrics = content(RESULTS[name].metrics)
    free, alone, joint = (metrics[method] for method in ("unconstrained", "hyperparameters", "joint"))
    assert joint["price"] == joint["objective"] - free["nlml"]
    assert sum(joint["price_by_bound"].values()) == pytest.approx(joint["objective"] - joint["nlml"], rel=1e-9)
    assert alone["nlml"] == alone["objective"]
    assert 0 < joint["price"] < alone["price"]


@BY_NAME
def test_summary_and_tables_hold_what_the_metrics_say(name: str) -> None:
    metrics, summary = content(RESULTS[name].metrics), content(RESULTS[name].summary)
    widths = {quantity.name: quantity.bounds.width for quantity in EXPERIMENTS[name].plant.quantities}
    margins = {series.topic: series.fields for series in read_stage(RESULTS[name], "verification").series}
    assert list(margins) == [f"/margins/{method}" for method in metrics]
    for method in ("unconstrained", "joint"):
        assert summary[f"objective_{method}"] == metrics[method]["objective"]
        relative = [metrics[method][f"worst_{name}_margin"] / width for name, width in widths.items()]
        assert summary[f"worst_relative_margin_{method}"] == pytest.approx(min(relative), rel=1e-12)
        logged = [min(margins[f"/margins/{method}"][f"{name}_margin"]) / width for name, width in widths.items()]
        assert min(logged) == summary[f"worst_relative_margin_{method}"]
    assert summary["price_joint"] == metrics["joint"]["price"]
    rows = {row[0]: row[-1] for row in table_of_methods(RESULTS[name]).rows}
    assert rows == {method: found["proof"].startswith("proved for") for method, found in metrics.items()}


@BY_NAME
def test_the_checker_says_of_every_file_what_the_metrics_say_and_it_is_about_the_reference_of_the_log(
    name: str,
) -> None:
    metrics, learned = content(RESULTS[name].metrics), read_stage(RESULTS[name], "fit").attachments
    files = {path.name.split(".")[0]: path for path in RESULTS[name].certificate("joint").parent.iterdir()}
    assert files.keys() == metrics.keys()
    for method, path in files.items():
        written = content(path)
        assert written["reference"] == json.loads(learned[f"{method}.json"])["reference"], method
        verdict = check(written)
        is_proved = metrics[method]["proof"].startswith("proved for")
        assert isinstance(verdict, Proved if is_proved else Refuted), method


@BY_NAME
def test_loops_have_a_plan_at_each_step_on_what_is_proved_and_their_log_holds_what_is_counted(name: str) -> None:
    counted, closed = content(RESULTS[name].control), loops(name)
    for start, kept in counted["joint"].items():
        if start != "first_untrackable_step":
            assert (kept["infeasible_steps"], kept["unsolved_steps"]) == (0, 0), start
    assert counted["joint"]["first_untrackable_step"] is None
    assert counted["unconstrained"]["first_untrackable_step"] is not None
    system = EXPERIMENTS[name].plant.system
    for reference, by_start in by_reference(closed).items():
        for start, course in by_start.items():
            said, lost = counted[reference][start], course.infeasible
            assert len(lost) <= said["infeasible_steps"]
            assert said["first_infeasible_step"] in (None, *lost)
            states, inputs = course.together(system.states), course.together(system.inputs)
            moved = system.successor(states[:-1], inputs[:-1])
            np.testing.assert_allclose(moved, states[1:], atol=1e-12)
    if "online" in counted:
        offers = counted["online"]["offers"]
        assert all(offer["reason"] for offer in offers)
        assert counted["online"]["infeasible_steps"] == 0
        assert closed["/offers"]["taken"].tolist() == [float(offer["taken"]) for offer in offers]


@DISTURBED
def test_robust_references_leave_room_and_disturbed_loops_on_them_break_nothing(name: str) -> None:
    tightened = EXPERIMENTS[name].tightening.plant
    robust = fitted(name).learned["robust"].reference
    assert np.all(tightened.state_set.margin(robust.state(np.arange(300.0))) >= -1e-9)
    disturbed = content(RESULTS[name].control)["disturbed"]
    assert disturbed["tube"]["broken"] == 0
    for kind, counts in disturbed["robust"]["tube"].items():
        assert (counts["steps_without_plan"], counts["steps_outside"]) == (0, 0), kind
    states = EXPERIMENTS[name].plant.system.states
    for topic, course in below(loops(name), "disturbed").items():
        reference, controller, kind = topic.split("/")
        said = disturbed[reference][controller][kind]
        # A loop that is given up has no input at its last step, and no row for it.
        assert said["steps_without_plan"] - len(course.infeasible) in {0, 1}
        assert said["first_step_without_plan"] in {None, *course.infeasible}
        worst = np.min(EXPERIMENTS[name].plant.state_set.margin(course.together(states)[1:]))
        assert worst == said["worst_state_margin"]
    ends, single = loops(name)["/disturbed_range"], below(loops(name), "disturbed_runs").values()
    for run in single:
        for column, values in run.columns.items():
            assert np.all((ends[f"{column}_lowest"] <= values) & (values <= ends[f"{column}_highest"]))


def test_certificates_of_known_signals_bound_the_distance_from_them() -> None:
    (known,) = EXPERIMENTS["hand"].truth.values()
    for method in ("hyperparameters", "joint", "robust"):
        distance = content(RESULTS["hand"].metrics)[method]["accuracy"]["position"]
        assert distance["radius"] <= distance["least"] <= distance["error"]
        assert known.noise <= distance["error"] <= (distance["plant"] or np.inf)
        written = content(RESULTS["hand"].certificate(method))
        assert written["truth"][0]["of"]["second_derivative"] == known.second_derivative


@DISTURBED
def test_the_price_of_room_rises_from_the_nominal_reference_over_the_robust_one(name: str) -> None:
    price, metrics = content(RESULTS[name].control)["price_of_room"], content(RESULTS[name].metrics)
    by_size = dict(zip(price["sizes"], zip(price["price"], price["misfit"], strict=True), strict=True))
    for size, method in ((0.0, "joint"), (1.0, "robust")):
        cost, misfit = by_size[size]
        assert cost == pytest.approx(metrics[method]["price"], rel=1e-12)
        assert misfit == pytest.approx(metrics[method]["misfit"], rel=1e-9)
    assert np.all(np.diff(price["price"]) > 0)
    assert price["largest"] > 1


@pytest.mark.parametrize("name", ["example1", "hand"])
def test_a_run_is_that_of_the_tube_controller(name: str) -> None:
    tightening, reference = EXPERIMENTS[name].tightening, fitted(name).learned["robust"].reference
    course = runs._run(tightening, reference.window(0, 40), 0, 4)
    nominal = Controller(EXPERIMENTS[name].plant, 20)
    moved, pushed = runs.disturbed_plant("greedy", tightening, 4)
    loop = simulate(
        TubeController(tightening, 20, nominal.Q, nominal.R),
        reference,
        course[0, : len(tightening.given.system.states)],
        40,
        disturbances=pushed,
        successor=moved,
        measurement_noise=runs.noise(tightening, 4),
    )
    np.testing.assert_allclose(np.column_stack([loop.states[:-1], loop.inputs]), course, atol=1e-12)
