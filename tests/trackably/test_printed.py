"""What programs and notebooks print of objects says what they are, in a line."""

from dataclasses import replace

import numpy as np
import pytest

from tests.trackably.control.tube.instances import LOOPS
from trackably import Controller, Infeasible, Plan, Zonotope, mobile_robot, simulate
from trackably.control.stepping import Status, Unsolved
from trackably.fit import Contact
from trackably.recordings import Recording, Signal

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


def test_samples_and_recordings_are_printed_by_their_spans():
    signal = Signal([1763900000.25, 1763900003.5], [0.1, -2.0])
    said = "from 1763900000.25 s to 1763900003.5 s, values from -2 to 0.1)"
    assert (repr(signal), repr(signal.samples())) == (f"Signal(2 {said}", f"Samples(2 {said}")
    recording = Recording({"x": Signal([0.0, 1.5], [0.1, 0.2])}, origin=0)
    assert repr(recording) == "Recording(x: 2 samples from 0 to 1.5 s; time zero: 0 s on the file's own clock)"


@pytest.mark.parametrize(
    ("end", "said"), [(6.3148, "at 6.31 s"), (6.3063, "at 6.31 s"), (6.35, "between 6.31 and 6.35 s")]
)
def test_a_contact_that_lasts_no_time_that_is_printed_has_one_time(end, said):
    assert str(Contact("speed", "lower", 6.3063, end, 2.49)) == f"the speed lower bound costs 2.49 {said}"


def test_a_tightening_is_printed_by_the_sets_that_it_leaves():
    plant = LOOP.tightening.plant
    assert f"state_set={plant.state_set}, input_set={plant.input_set}" in repr(LOOP.tightening)
