"""Flat forms that are changed in a certificate are refused by the checker alone."""

import pytest

from tests.trackably.checker.changes import changed, with_changes
from tests.trackably.systems.forms.instances import certificate
from trackably.checker import Failed, NotACertificate, check

SYSTEM = "reference.plant.system"
FLAT = f"{SYSTEM}.flat"
TAMPERED = {
    "the sign of an input": (f"{FLAT}.inputs.1", lambda turn: ["*", -1.0, turn]),
    "a slower clock": (f"{FLAT}.inputs.0", lambda speed: ["*", 0.999999, speed]),
    "a later state": (f"{FLAT}.states.0", "z1[1]"),
    "another signal": (f"{FLAT}.states.0", "z2[0]"),
    "a mirrored heading": (f"{FLAT}.states.2.1", lambda ahead: ["*", -1.0, ahead]),
    "no angles": (f"{FLAT}.angles", ["x"]),
    "an angle that is none": (f"{FLAT}.angles", ["speed"]),
    "a signal too many": (f"{FLAT}.states.0", ["+", "z1[0]", ["*", 0.0, "z3[0]"]]),
    "no signal": (f"{FLAT}.states.0", "x"),
    "another system": (f"{SYSTEM}.f.2", ["+", "heading", ["*", 0.11, "turn"]]),
    "a drift": (f"{SYSTEM}.f.0", ["+", "x", ["*", 0.1, "speed"]]),
    "fewer states": (f"{FLAT}.states", lambda states: states[:2]),
    "a positive formula that is negative somewhere": (f"{FLAT}.positive", ["z1[0]"], "may not be positive"),
    "a positive formula of the far future": (f"{FLAT}.positive", ["z1[9]"], "ahead"),
    "an error that is too small": ("evaluation.errors.turn", 1e-12, "float64"),
}
"""The path of a part, what is put there, and the reason if it is not the flat form."""


@pytest.mark.parametrize("which", TAMPERED)
def test_a_changed_certificate_is_refused_for_its_reason(which):
    path, put, *reason = TAMPERED[which]
    verdict = check(changed(certificate(), path, put))
    assert isinstance(verdict, Failed | NotACertificate), verdict
    assert (reason or ["flat"])[0] in verdict.reason


def test_a_robot_that_turns_back_is_refused_though_nothing_bounds_its_speed():
    """On a line there and back it stands still twice: nothing but the formulas' own needs says so."""
    inputs = "reference.plant.input_set"
    still = {"reference.signals.1.weights": [0.0] * 24, f"{inputs}.lower": [-1.0, -40.0], f"{inputs}.upper.1": 40.0}
    verdict = check(with_changes(certificate(), still))
    assert isinstance(verdict, Failed)
    assert "is not shown to be defined" in verdict.reason
