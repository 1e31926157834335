"""Headings that cross ±π: formulas of them do not jump where they need not, and where they must nothing is proved."""

import json

import numpy as np
import pytest

from tests.trackably.checker.changes import changed
from tests.trackably.systems.forms.instances import T_S, along, eight, robot
from trackably.certificates.certificate import Certificate
from trackably.certificates.form import encode_certificate
from trackably.certificates.outcome import Unproved
from trackably.certificates.prove import prove
from trackably.checker import Failed, check
from trackably.checker.certificate import Window
from trackably.checker.formulas import Angle, Name
from trackably.codec import dumps, loads
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.signal import KernelSum
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.flat_forms import FlatForm, with_heading_in
from trackably.systems.formulas import evaluate_floats
from trackably.systems.intervals import Interval
from trackably.systems.nonlinear import NonlinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference

HEADING = FlatForm((Angle(Name("z2[0]"), Name("z1[0]")),), (Name("z1[1]"),), ("heading",))
INPUT_SET = Polytope.box([0.1, -2.5], [1.5, 2.5])


def differences(z):
    """The flat form as users write it: the turn rate is a difference of headings."""
    states, (speed, _) = along(z)
    now, later = z[1] - z[0], z[2] - z[1]
    return states, [speed, (np.arctan2(later[1], later[0]) - np.arctan2(now[1], now[0])) / T_S]


@pytest.mark.parametrize(("middle", "half"), [(-12.0, 2.3), (0.0, 3.05), (4.5, 3.05), (12.0, 2.3)])
def test_a_heading_within_bounds_is_the_same_direction_and_does_not_jump_inside_of_them(middle: float, half: float):
    form = with_heading_in(HEADING, 0, Interval(middle - half, middle + half))
    true = middle + np.linspace(-half, half, 51)
    at = {"z1[0]": 2.0 * np.cos(true), "z2[0]": 2.0 * np.sin(true)}
    np.testing.assert_allclose(evaluate_floats(form.states[0], at), true, atol=1e-12)


def test_turns_that_are_written_as_differences_of_headings_do_not_jump():
    plant = ConstrainedSystem(robot(differences), eight().plant.state_set, INPUT_SET)
    reference, same = Reference(eight().signals, plant), eight()
    steps = np.arange(240)
    np.testing.assert_allclose(reference.input(steps), same.input(steps), atol=1e-9)


def westward(low: float, high: float) -> Reference:
    """A path that weaves about the direction of ±π, with bounds of its heading."""
    times = np.arange(-1.0, 8.0, 0.5)
    kernel = SquaredExponential(1.0, 2.0)
    gram = kernel.jet(times[:, None] - times, 0)[0] + 1e-8 * np.eye(len(times))
    x, y = (KernelSum(kernel, 0.0, times, np.linalg.solve(gram, v)) for v in (-0.5 * times, 0.3 * np.sin(1.2 * times)))
    states = Polytope.box([-30.0, -3.0, low], [30.0, 3.0, high])
    return Reference((x, y), ConstrainedSystem(robot(), states, INPUT_SET))


def test_bounds_of_a_heading_around_minus_pi_are_proved_and_checked():
    low, high = -np.pi - 1.0, -np.pi + 1.0
    reference = westward(low, high)
    found = prove(reference, Window(0.0, 6.0))
    assert isinstance(found, Certificate), found
    data = json.loads(json.dumps(encode_certificate(found)))
    heading = reference.state_at(np.linspace(0.0, 6.0, 301))[:, 2]
    assert low < np.min(heading) < -np.pi < np.max(heading) < high
    written = dumps(reference.plant.system)
    assert dumps(loads(NonlinearSystem, written)) == written
    quarters = "reference.plant.system.flat.states.2.1.1"
    for wrong in (1.0, -2.0 + 1e-9, -5.0):
        verdict = check(changed(data, quarters, wrong))
        assert isinstance(verdict, Failed)
        assert "flat: f is not shown to give" in verdict.reason


def test_a_heading_that_jumps_is_refused_with_the_place():
    found = prove(eight(heading=4.0))
    assert isinstance(found, Unproved)
    assert "6.1 rad wide" in found.reason
    start, end = found.box
    before, after = eight().state_at(np.array([start - 1e-6, end + 1e-6]))[:, 2]
    assert abs(before - after) == pytest.approx(2 * np.pi, abs=0.1)
