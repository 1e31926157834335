"""Certificates that are changed, or about something else, and what comparison says of them."""

from pathlib import Path

import pytest

from pipeline.compare.model import Status
from tests.pipeline.compare.project import (
    RESULTS,
    compared,
    edit_json,
    moved,
    only,
)


def test_a_certificate_for_another_reference(base: Path, new: Path) -> None:
    edit_json(
        new / RESULTS / "certificate.json",
        lambda c: c["reference"]["signals"][0]["weights"].__setitem__(0, 1.5 + 1e-12),
    )
    row = only(compared(base, new))
    assert (row.name, row.status) == ("example1/certificate.json reference", Status.DIFFERENT)
    assert row.notes == (
        "in NEW, the certificate is for another reference: signals[0].weights[0] is 1.500000000001 in it, "
        "and 1.5 in the reference 'sound' of example1/fit.mcap",
    )


@pytest.mark.parametrize(
    ("change", "place", "value"),
    [
        (lambda p: p["state_set"]["upper"].__setitem__(0, 0.06), "state_set.upper[0]", 0.06),
        (lambda p: p["state_set"]["rows"][1].__setitem__(1, 1.1), "state_set.rows[1][1]", 1.1),
        (lambda p: p["input_set"]["lower"].__setitem__(0, -0.6), "input_set.lower[0]", -0.6),
        (lambda p: p["system"]["A"][0].__setitem__(1, 0.2), "system.A[0][1]", 0.2),
        (lambda p: p["system"].update(sampling_time=0.02), "system.sampling_time", 0.02),
        (lambda p: p["system"]["states"].reverse(), "system.states[0]", "v"),
        (lambda p: p["state_set"]["rows"].pop(1), "state_set.rows[1][0]", "not there"),
    ],
)
def test_a_certificate_for_another_system(base: Path, new: Path, change, place: str, value: object) -> None:
    edit_json(new / RESULTS / "certificate.json", lambda c: change(c["reference"]["plant"]))
    *_, reference = moved(compared(base, new))
    assert reference.name == "example1/certificate.json reference"
    assert (
        f"plant.{place} is {value if isinstance(value, str) and ' ' in value else repr(value)} in it"
        in reference.notes[0]
    )


def test_a_certificate_with_another_bound(base: Path, new: Path) -> None:
    edit_json(
        new / RESULTS / "certificate.json", lambda c: c["reference"]["plant"]["state_set"]["upper"].__setitem__(0, 0.06)
    )
    own, _ = moved(compared(base, new))
    assert (own.worst[0].place, own.worst[0].base, own.worst[0].new) == (
        "reference.plant.state_set.upper[0]",
        0.05,
        0.06,
    )


def test_other_boxes_of_a_proof_are_not_compared(base: Path, new: Path) -> None:
    edit_json(new / RESULTS / "certificate.json", lambda c: c["claim"]["covers"]["x"].update(ends=[0.0, 0.5, 1.0]))
    comparison = compared(base, new)
    assert comparison.within
    assert any("boxes of a proof" in note for row in comparison.rows for note in row.notes)


def test_a_certificate_of_an_earlier_version(base: Path, new: Path) -> None:
    def earlier(certificate: dict[str, object]) -> None:
        certificate |= {"version": 2, "signals": []}
        del certificate["reference"]

    for root in (base, new):
        edit_json(root / RESULTS / "certificate.json", earlier)
    row = only(compared(base, new))
    said = "the certificate names no reference: it is of an earlier version, or damaged"
    assert row.notes == (f"in BASE, {said}", f"in NEW, {said}")
