"""Hostile names: nothing is printed that a certificate does not prove, and nothing crashes on printing."""

import copy

import pytest

from tests.trackably.checker.changes import changed
from tests.trackably.checker.instances import scalar_certificate
from tests.trackably.systems.test_naming import NAMES, NO_NAMES
from trackably.checker import Failed, NotACertificate, Proved, check


def renamed(old: str, new: str) -> dict:
    """The scalar certificate with another name for its state, wherever it stands."""
    data = copy.deepcopy(scalar_certificate())
    data["reference"]["plant"]["system"]["states"] = [new]
    for of in (data["claim"]["covers"], data["evaluation"]["errors"]):
        of[new] = of.pop(old)
    return data


@pytest.mark.parametrize("name", NAMES)
def test_identifiers_are_quoted_where_they_are_printed(name: str) -> None:
    verdict = check(renamed("state", name))
    assert isinstance(verdict, Proved)
    assert f' ≤ "{name}" ≤ ' in verdict.statement
    assert f'"{name}" = ' in verdict.statement


@pytest.mark.parametrize("name", NO_NAMES, ids=ascii)
def test_anything_else_is_no_name(name: str) -> None:
    """The prover refuses the same: see tests/trackably/systems/test_naming.py."""
    for data in (renamed("state", name), changed(scalar_certificate(), "reference.plant.system.inputs", [name])):
        verdict = check(data)
        assert isinstance(verdict, NotACertificate)
        assert verdict.reason.isprintable()
        assert len(verdict.reason) < 250


@pytest.mark.parametrize("hostile", ["x\x1b[2J", "\ud800", "a\nProved", "x ≤ 1, y", "x" * 2000, "\u202ex"], ids=ascii)
def test_whatever_stands_in_a_file_what_is_printed_is_one_printable_line(hostile: str) -> None:
    """Keys, tags, versions and numbers that are none; formulas too."""
    data = scalar_certificate()
    system = data["reference"]["plant"]["system"]
    hostiles = [
        {**data, hostile: 1},
        {**data, "format": hostile},
        {**data, "version": hostile},
        {**data, "version": [hostile] * 1000},
        changed(data, "claim.kind", hostile),
        changed(data, "claim.covers", {hostile: {}}),
        changed(data, "claim.covers", {**data["claim"]["covers"], hostile: data["claim"]["covers"]["state"]}),
        changed(data, "evaluation.errors", {**data["evaluation"]["errors"], hostile: 1.0}),
        changed(data, "reference.signals.0.kernel.type", hostile),
        changed(data, "reference.signals.0.mean", hostile),
        changed(data, "trajectories.states.0.offset", hostile),
        changed(data, "reference.plant.system", {**system, hostile: 1}),
    ]
    law = {"f": [["+", hostile, "input"]], "sampling_time": 0.1, "states": ["state"], "inputs": ["input"]}
    nonlinear = {key: value for key, value in data.items() if key != "trajectories"}
    hostiles.append(changed(nonlinear, "reference.plant.system", law))
    for other in hostiles:
        verdict = check(other)
        assert isinstance(verdict, NotACertificate | Failed)
        assert verdict.reason.isprintable()
        assert len(verdict.reason) < 300
