"""Hostile names: nothing is printed that a certificate does not prove, and nothing crashes on printing."""

import pytest

from tests.trackably.checker.changes import changed
from tests.trackably.checker.instances import scalar_certificate
from tests.trackably.systems.test_naming import NAMES, NO_NAMES
from trackably.checker import NotACertificate, Proved, check


def renamed(new: str) -> dict:
    """The scalar certificate with another name for its state, wherever it stands."""
    data = changed(scalar_certificate(), "reference.plant.system.states", [new])
    for of in (data["claim"]["covers"], data["evaluation"]["errors"]):
        of[new] = of.pop("state")
    return data


@pytest.mark.parametrize("name", NAMES)
def test_identifiers_are_quoted_where_they_are_printed(name: str) -> None:
    verdict = check(renamed(name))
    assert isinstance(verdict, Proved)
    assert f' ≤ "{name}" ≤ ' in verdict.statement
    assert f'"{name}" = ' in verdict.statement


@pytest.mark.parametrize("name", NO_NAMES, ids=ascii)
def test_anything_else_is_no_name(name: str) -> None:
    """The prover refuses the same: see tests/trackably/systems/test_naming.py."""
    for data in (renamed(name), changed(scalar_certificate(), "reference.plant.system.inputs", [name])):
        verdict = check(data)
        assert isinstance(verdict, NotACertificate)
        assert verdict.reason.isprintable()
        assert len(verdict.reason) < 250
