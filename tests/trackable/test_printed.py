"""What programs and notebooks print of objects says what they are, in a line."""

from dataclasses import replace

import numpy as np
import pytest

from tests.trackable.control.tube.instances import LOOPS
from trackable import Controller, Infeasible, Plan, Zonotope, mobile_robot, simulate
from trackable.control.step.result import Status, Unsolved

LOOP = LOOPS["example1"]
PLAN = LOOP.controller.step(0, LOOP.reference.state(0), LOOP.reference)
SIMULATED = simulate(LOOP.controller, LOOP.reference, LOOP.reference.state(0), 3)
FAR = LOOP.controller.step(0, LOOP.reference.state(0) + 100, LOOP.reference)
NOWHERE = Controller(LOOP.controller.plant, 20, [[1]], [[1]]).step(0, [1e300], LOOP.reference)


@pytest.mark.parametrize(
    ("printed", "wanted"),
    [
        (PLAN, f"Plan({PLAN.explanation}; input {PLAN.input.tolist()})"),
        (FAR, f"Infeasible({FAR.explanation}; fallback {FAR.fallback.tolist()})"),
        (NOWHERE, f"Unsolved({NOWHERE.explanation}; fallback {NOWHERE.fallback.tolist()})"),
        (Zonotope.box([-0.1, 0], [0.1, 0]), "Zonotope(centre=[0.0, 0.0], generators=[[0.1, 0.0]])"),
    ],
)
def test_results_and_sets_are_printed_in_words(printed, wanted):
    assert repr(printed) == wanted


def test_the_results_above_are_of_all_kinds():
    assert [type(result) for result in (PLAN, FAR, NOWHERE)] == [Plan, Infeasible, Unsolved]


@pytest.mark.parametrize("status", Status)
def test_a_plan_says_in_words_how_it_was_found(status):
    """The words of logs are not for people: "unbounded" is a plan on which no bound is active."""
    said = replace(PLAN, status=status).explanation
    assert said.startswith(f"at step 0 feasible ({status.words}), V = ")
    assert status.words != status.value


def test_a_loop_is_printed_by_its_errors_and_failures():
    largest = np.max(np.abs(SIMULATED.errors))
    assert repr(SIMULATED) == f"ClosedLoop(steps 0 to 3, largest errors {largest:.3g}, 0 infeasible, 0 unsolved)"


def test_formulas_are_printed_as_formulas():
    said = repr(mobile_robot(0.1))
    assert said.startswith("NonlinearSystem(f=(x + 0.1 * speed * cos(heading), y + 0.1 * speed * sin(heading), ")
    assert "FlatForm(states=(z1[0], z2[0], atan2(" in said


def test_a_tightening_is_printed_by_the_sets_that_it_leaves():
    plant = LOOP.tightening.plant
    assert f"state_set={plant.state_set}, input_set={plant.input_set}" in repr(LOOP.tightening)
