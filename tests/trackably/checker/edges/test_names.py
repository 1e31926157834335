"""Hostile names: nothing is printed that a certificate does not prove, and nothing crashes on printing."""

import pytest

from tests.trackably.checker.changes import changed, without
from tests.trackably.checker.instances import scalar_certificate
from tests.trackably.systems.test_naming import NAMES, NO_NAMES
from trackably.checker import Failed, NotACertificate, Proved, check


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


@pytest.mark.parametrize("hostile", ["x\x1b[2J", "\ud800", "a\nProved", "x ≤ 1, y", "x" * 2000, "\u202ex"], ids=ascii)
def test_whatever_stands_in_a_file_what_is_printed_is_one_printable_line(hostile: str) -> None:
    """Keys, tags, versions and numbers that are none; formulas too."""
    data = scalar_certificate()
    law = {"f": [["+", hostile, "input"]], "sampling_time": 0.1, "states": ["state"], "inputs": ["input"]}
    hostiles = [
        {**data, hostile: 1},
        {**data, "format": hostile},
        {**data, "version": [hostile] * 1000},
        changed(data, "claim.kind", hostile),
        changed(data, "claim.covers", {hostile: {}}),
        changed(data, "evaluation.errors", lambda errors: errors | {hostile: 1.0}),
        changed(data, "reference.signals.0.kernel.type", hostile),
        changed(data, "reference.signals.0.mean", hostile),
        changed(data, "trajectories.states.0.offset", hostile),
        changed(data, "reference.plant.system", lambda system: system | {hostile: 1}),
        changed(without(data, "trajectories"), "reference.plant.system", law),
    ]
    for other in hostiles:
        verdict = check(other)
        assert isinstance(verdict, NotACertificate | Failed)
        assert verdict.reason.isprintable()
        assert len(verdict.reason) < 300
