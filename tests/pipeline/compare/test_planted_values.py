"""One change is planted in a log, a table or a JSON file in each test: the comparison says where and how large."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pipeline.compare.model import ABSENT, Comparison, Status
from pipeline.storage.logs import Series
from tests.pipeline.compare.project import (
    RESULTS,
    compared,
    edit_json,
    edit_log,
    edit_text,
    moved,
    only,
    with_sample,
)


def test_identical_folders_are_identical(base: Path, new: Path) -> None:
    comparison = compared(base, new)
    assert {row.status for row in comparison.rows} == {Status.IDENTICAL}
    assert all(claim.base.holds and claim.new.holds for claim in comparison.claims)
    assert comparison.within
    names = {row.name for row in comparison.rows}
    assert {
        "example1/metrics.json",
        "example1/iterations.csv",
        "example1/fit.mcap /references/sound mean",
        "example1/fit.mcap /samples t",
        "example1/fit.mcap attachment sound.json",
        "example1/figures/margins.svg",
        "example1/certificate.json",
        "notebooks/example1.ipynb",
    } <= names


def test_a_metric_off_by_2e_5(base: Path, new: Path) -> None:
    edit_json(new / RESULTS / "metrics.json", lambda m: m["sound"].update(nlml=m["sound"]["nlml"] + 2e-5))
    row = only(compared(base, new))
    worst = row.worst[0]
    assert (row.artifact, row.status, row.differing, row.beyond) == ("example1/metrics.json", Status.DIFFERENT, 1, 1)
    assert (worst.place, worst.base, worst.rule.name) == ("sound.nlml", -3.7160332, "metrics")
    assert worst.absolute == pytest.approx(2e-5)
    assert worst.relative == pytest.approx(2e-5 / 3.7160332)


def test_one_sample_of_one_topic(base: Path, new: Path) -> None:
    change = {"/references/sound": lambda s: with_sample(s, "mean", 7, s.fields["mean"][7] + 1e-4)}
    edit_log(new / RESULTS / "fit.mcap", lambda s: change.get(s.topic, lambda s: s)(s))
    row = only(compared(base, new))
    assert (row.artifact, row.topic, row.field) == ("example1/fit.mcap", "/references/sound", "mean")
    assert (row.worst[0].place, row.compared, row.differing) == ("t = 0.07 s", 10, 1)
    assert row.worst[0].absolute == pytest.approx(1e-4)


def test_a_sample_left_out_is_missed_at_its_time(base: Path, new: Path) -> None:
    keep = np.arange(10) != 4

    def shorter(s: Series) -> Series:
        return replace(s, times=s.times[keep], fields={name: values[keep] for name, values in s.fields.items()})

    edit_log(new / RESULTS / "fit.mcap", lambda s: shorter(s) if s.topic == "/samples" else s)
    rows = moved(compared(base, new))
    assert [row.field for row in rows] == ["t", "value"]
    assert {(row.worst[0].place, row.worst[0].new, row.differing) for row in rows} == {("t = 0.04 s", ABSENT, 1)}


def test_a_dropped_topic(base: Path, new: Path) -> None:
    edit_log(new / RESULTS / "fit.mcap", lambda s: None if s.topic == "/samples" else s)
    row = only(compared(base, new))
    assert (row.name, row.status) == ("example1/fit.mcap /samples", Status.MISSING)


def test_a_topic_too_many_and_a_field_less(base: Path, new: Path) -> None:
    edit_log(base / RESULTS / "fit.mcap", lambda s: None if s.topic == "/samples" else s)
    edit_log(new / RESULTS / "fit.mcap", lambda s: replace(s, fields={n: s.fields[n] for n in s.fields if n != "std"}))
    rows = moved(compared(base, new))
    assert [(row.topic, row.field, row.status) for row in rows] == [
        ("/references/sound", "std", Status.MISSING),
        ("/samples", "", Status.EXTRA),
    ]


def test_a_cell_and_a_row(base: Path, new: Path) -> None:
    edit_text(new / RESULTS / "iterations.csv", "82,0.5\n83,0.4\n", "82,0.51\n")
    row = only(compared(base, new))
    assert [(d.place, d.new) for d in row.worst] == [
        ("column k_bar, line 5", ABSENT),
        ("column bound, line 5", ABSENT),
        ("column bound, line 4", 0.51),
    ]


def test_a_nan_in_each_kind_of_artifact(base: Path, new: Path) -> None:
    edit_json(new / RESULTS / "metrics.json", lambda m: m["sound"].update(nlml=math.nan))
    edit_text(new / RESULTS / "iterations.csv", "82,0.5", "82,nan")
    edit_log(new / RESULTS / "fit.mcap", lambda s: with_sample(s, "value", 3, math.nan) if s.topic == "/samples" else s)
    rows = moved(compared(base, new))
    assert [(row.name, row.worst[0].place) for row in rows] == [
        ("example1/fit.mcap /samples value", "t = 0.03 s"),
        ("example1/iterations.csv", "column bound, line 4"),
        ("example1/metrics.json", "sound.nlml"),
    ]
    for row in rows:
        value = row.worst[0].new
        assert isinstance(value, float)
        assert math.isnan(value)
        assert (row.worst[0].absolute, row.worst[0].excess, row.beyond) == (None, math.inf, 1)


def test_a_truncated_log(base: Path, new: Path) -> None:
    path = new / RESULTS / "fit.mcap"
    path.write_bytes(path.read_bytes()[:-100])
    log, certificate = moved(compared(base, new))
    assert (log.name, log.status) == ("example1/fit.mcap", Status.DIFFERENT)
    assert log.notes[0].startswith("cannot be read in NEW: ")
    assert "fit.mcap cannot be read" in certificate.notes[0]


def test_a_log_damaged_on_both_sides_is_not_identical(base: Path, new: Path) -> None:
    for root in (base, new):
        path = root / RESULTS / "fit.mcap"
        path.write_bytes(path.read_bytes()[:-100])
    log = moved(compared(base, new))[0]
    assert [note.split(":")[0] for note in log.notes] == ["cannot be read in BASE", "cannot be read in NEW"]


def test_a_missing_and_an_extra_file(base: Path, new: Path) -> None:
    (new / RESULTS / "iterations.csv").unlink()
    (new / RESULTS / "more.txt").write_text("more")
    assert [(row.artifact, row.status) for row in moved(compared(base, new))] == [
        ("example1/iterations.csv", Status.MISSING),
        ("example1/more.txt", Status.EXTRA),
    ]


def test_rounding_is_within_tolerance(base: Path, new: Path) -> None:
    edit_json(new / RESULTS / "metrics.json", lambda m: m["sound"].update(nlml=m["sound"]["nlml"] * (1 + 1e-12)))
    edit_text(new / RESULTS / "iterations.csv", "0.7", "0.70000000001")
    edit_text(new / "notebooks/example1.ipynb", "0.659325", "0.65932500001")
    edit_log(new / RESULTS / "fit.mcap", lambda s: replace(s, fields={n: v * (1 + 1e-13) for n, v in s.fields.items()}))
    comparison = compared(base, new)
    assert comparison.within
    assert {row.artifact for row in comparison.rows if row.status is Status.WITHIN} == {
        "example1/metrics.json",
        "example1/iterations.csv",
        "example1/fit.mcap",
        "notebooks/example1.ipynb",
    }


def test_wall_clock_is_never_compared(base: Path, new: Path) -> None:
    edit_json(new / RESULTS / "metrics.json", lambda m: m["sound"].update(seconds=99.0))
    comparison: Comparison = compared(base, new)
    row = next(row for row in comparison.rows if row.artifact == "example1/metrics.json")
    assert (row.status, row.differing) == (Status.WITHIN, 0)
    assert "wall clock" in row.notes[0]


def test_the_same_content_in_other_bytes(base: Path, new: Path) -> None:
    edit_text(new / RESULTS / "metrics.json", "-3.7160332", "-3.71603320")
    row = next(row for row in compared(base, new).rows if row.artifact == "example1/metrics.json")
    assert (row.status, row.notes) == (Status.WITHIN, ("the same content in other bytes",))
