"""Flat forms that are changed in a certificate are refused by the checker alone."""

import copy

import pytest

from tests.trackably.checker.changes import changed
from tests.trackably.systems.forms.instances import certificate
from trackably.checker import Failed, NotACertificate, check

FLAT = "reference.plant.system.flat"


def flat() -> dict:
    return copy.deepcopy(certificate()["reference"]["plant"]["system"]["flat"])


TAMPERED = {
    "the sign of an input": (f"{FLAT}.inputs.1", lambda form: ["*", -1.0, form["inputs"][1]]),
    "a slower clock": (f"{FLAT}.inputs.0", lambda form: ["*", 0.999999, form["inputs"][0]]),
    "a later state": (f"{FLAT}.states.0", lambda form: "z1[1]"),
    "another signal": (f"{FLAT}.states.0", lambda form: "z2[0]"),
    "a mirrored heading": (
        f"{FLAT}.states.2",
        lambda form: ["atan2", ["*", -1.0, form["states"][2][1]], form["states"][2][2]],
    ),
    "no angles": (f"{FLAT}.angles", lambda form: ["x"]),
    "an angle that is none": (f"{FLAT}.angles", lambda form: ["speed"]),
    "a signal too many": (f"{FLAT}.states.0", lambda form: ["+", "z1[0]", ["*", 0.0, "z3[0]"]]),
    "no signal": (f"{FLAT}.states.0", lambda form: "x"),
    "another system": ("reference.plant.system.f.2", lambda form: ["+", "heading", ["*", 0.11, "turn"]]),
    "a drift": ("reference.plant.system.f.0", lambda form: ["+", "x", ["*", 0.1, "speed"]]),
    "fewer states": (f"{FLAT}.states", lambda form: form["states"][:2]),
}


@pytest.mark.parametrize("which", TAMPERED)
def test_a_changed_certificate_is_refused(which):
    path, change = TAMPERED[which]
    verdict = check(changed(certificate(), path, change(flat())))
    assert isinstance(verdict, Failed | NotACertificate), verdict
    assert isinstance(verdict, Failed) or "flat" in verdict.reason


def test_an_error_that_is_too_small_is_refused():
    verdict = check(changed(certificate(), "evaluation.errors.turn", 1e-12))
    assert isinstance(verdict, Failed)
    assert "float64" in verdict.reason


def test_a_robot_that_turns_back_is_refused_though_nothing_bounds_its_speed():
    """On a line there and back it stands still twice: nothing but the formulas' own needs says so."""
    still = changed(certificate(), "reference.signals.1.weights", [0.0] * 24)
    for side, row, low in (("input_set", 0, -1.0), ("input_set", 1, -40.0)):
        still = changed(still, f"reference.plant.{side}.lower.{row}", low)
    still = changed(still, "reference.plant.input_set.upper.1", 40.0)
    verdict = check(still)
    assert isinstance(verdict, Failed)
    assert "turn is not shown to be defined" in verdict.reason or "speed is not shown to be defined" in verdict.reason


def test_a_claimed_positive_formula_that_is_negative_somewhere_is_refused():
    system = "reference.plant.system.flat"
    verdict = check(changed(certificate(), system, {**flat(), "positive": ["z1[0]"]}))
    assert isinstance(verdict, Failed)
    assert "may not be positive" in verdict.reason
