"""One change is planted in an artifact: the comparison says in which one, where, and what stands there now."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pipeline.compare.artifacts import ABSENT
from pipeline.compare.model import Status
from pipeline.storage.logs import Series
from tests.pipeline.compare.project import (
    LOG,
    RESULTS,
    Plant,
    compared,
    edit_json,
    edit_log,
    edit_text,
    figure,
    metric,
    moved,
    only,
)

METRICS, TABLE, FIGURE, CERTIFICATE, NOTEBOOK = (
    *(RESULTS / name for name in ("metrics.json", "iterations.csv", "figures/margins.svg")),
    RESULTS / "certificates/sound.json",
    Path("notebooks/example1.ipynb"),
)


def sample(topic: str, field: str, row: int, value: float) -> Plant:
    def change(series: Series) -> Series:
        if series.topic != topic:
            return series
        values = np.where(np.arange(len(series.times)) == row, value, series.fields[field])
        return replace(series, fields={**series.fields, field: values})

    return edit_log(change)


MOVED: dict[str, tuple[Plant, str, str]] = {
    "a metric": (metric(nlml=-3.7160332 + 2e-5), "example1/metrics.json", "sound.nlml"),
    "a number of a sentence": (metric(said="at 0.2813 s"), "example1/metrics.json", "sound.said, number 1"),
    "a cell of a table": (edit_text(TABLE, "82,0.5", "82,0.51"), "example1/iterations.csv", "column bound, line 4"),
    "a row of a table": (edit_text(TABLE, "83,0.4\n", ""), "example1/iterations.csv", "column k_bar, line 5"),
    "a sample": (
        sample("/references/sound", "mean", 7, 0.7001),
        "example1/fit.mcap /references/sound mean",
        "t = 0.07 s",
    ),
    "a sample is lost": (sample("/samples", "value", 3, math.nan), "example1/fit.mcap /samples value", "t = 0.03 s"),
    "a colour": (
        edit_text(FIGURE, "#d55e00", "#0072b2"),
        "example1/figures/margins.svg",
        "line2d_1 path: style",
    ),
    "a point": (
        edit_text(FIGURE, "L 3 1", "L 3 1.9"),
        "example1/figures/margins.svg",
        "line2d_1 path: centre y",
    ),
    "a word on a figure": (
        edit_text(FIGURE, "step $k$", "time"),
        "example1/figures/margins.svg",
        "text_1 comment: text",
    ),
    "a curve": (
        edit_text(FIGURE, "L 4 2", "L 4 2 L 9 2"),
        "example1/figures/margins.svg",
        "line2d_1 path: right",
    ),
    "a number in a notebook": (
        edit_text(NOTEBOOK, "0.659325", "0.659345"),
        "notebooks/example1.ipynb",
        "cell 'table', output 1, text[1], number 1",
    ),
    "a word in a notebook": (
        edit_text(NOTEBOOK, "learned", "failed"),
        "notebooks/example1.ipynb",
        "cell 'table', output 1, text[0]",
    ),
}


@pytest.mark.parametrize(("plant", "name", "place"), MOVED.values(), ids=MOVED)
def test_a_change_is_found_where_it_is_and_nowhere_else(
    base: Path, new: Path, plant: Plant, name: str, place: str
) -> None:
    plant(new)
    row = only(compared(base, new))
    assert (row.name, row.status, row.worst.place) == (name, Status.DIFFERENT, place)


def test_a_difference_is_told_with_its_size_and_its_rule(base: Path, new: Path) -> None:
    metric(nlml=-3.7160332 + 2e-5)(new)
    worst = only(compared(base, new)).worst
    assert (worst.base, worst.rule.name) == (-3.7160332, "metrics")
    assert (worst.absolute, worst.relative) == pytest.approx((2e-5, 2e-5 / 3.7160332))


def test_identical_folders_are_identical(base: Path, new: Path) -> None:
    comparison = compared(base, new)
    assert comparison.within
    assert {row.status for row in comparison.rows} == {Status.IDENTICAL}
    assert all(claim.base.holds and claim.new.holds for claim in comparison.claims)
    names = {path.relative_to(new).as_posix().removeprefix("data/results/") for path in new.rglob("*.*")}
    assert {row.artifact for row in comparison.rows} == names


UNMOVED: dict[str, Plant] = {
    "rounding in a metric": metric(nlml=-3.7160332 * (1 + 1e-12)),
    "rounding in a sentence": metric(said="at 0.2812170167239515 s"),
    "rounding in a table": edit_text(TABLE, "0.7", "0.70000000001"),
    "rounding in a notebook": edit_text(NOTEBOOK, "0.659325", "0.65932500001"),
    "rounding in a log": edit_log(lambda s: replace(s, fields={n: v * (1 + 1e-13) for n, v in s.fields.items()})),
    "rounding in a figure": edit_text(FIGURE, "L 2 2", "L 2.001 2"),
    "a point on a line": edit_text(FIGURE, "M 1 1 L 2 2", "M 1 1 L 1.5 1.5 L 2 2"),
    "a line from its other end": edit_text(FIGURE, "M 1 1 L 2 2 L 3 1 L 4 2", "M 4 2 L 3 1 L 2 2 L 1 1"),
    "a name by its hash": edit_text(FIGURE, "m0772998e1b", "mffffffffff"),
    "outlines of other digits": lambda root: (root / FIGURE).write_text(figure("4.480002")),
    "what Coq has proved of other bits": edit_text(NOTEBOOK, "7 samples, checked by Coq", "9 samples"),
    "wall clock": metric(seconds=99.0),
    "other bytes": edit_text(METRICS, "-3.7160332", "-3.71603320"),
    "boxes of a proof": edit_json(CERTIFICATE, lambda c: c["claim"]["covers"]["x"].update(ends=[0.0, 0.5, 1.0])),
    "a cell of prose": edit_json(
        NOTEBOOK,
        lambda n: n["cells"].insert(0, {"cell_type": "markdown", "id": "c", "metadata": {}, "source": "More"}),
    ),
}


@pytest.mark.parametrize("plant", UNMOVED.values(), ids=UNMOVED)
def test_what_says_the_same_is_within_tolerance(base: Path, new: Path, plant: Plant) -> None:
    plant(new)
    comparison = compared(base, new)
    assert comparison.within
    assert comparison.counts[Status.IDENTICAL] == 5, "of six artifacts, however many parts a log has"


def test_what_is_missing_or_added_is_named(base: Path, new: Path) -> None:
    (new / TABLE).unlink()
    (new / RESULTS / "more.txt").write_text("more")
    edit_log(lambda s: None if s.topic == "/samples" else s)(base)
    edit_log(lambda s: replace(s, fields={n: s.fields[n] for n in s.fields if n != "std"}))(new)
    assert [(row.name, row.status) for row in moved(compared(base, new))] == [
        ("example1/fit.mcap /references/sound std", Status.MISSING),
        ("example1/fit.mcap /samples t", Status.EXTRA),
        ("example1/fit.mcap /samples value", Status.EXTRA),
        ("example1/iterations.csv", Status.MISSING),
        ("example1/more.txt", Status.EXTRA),
    ]


def test_a_sample_left_out_is_missed_at_its_time(base: Path, new: Path) -> None:
    def without_one(s: Series) -> Series:
        return replace(s, times=np.delete(s.times, 4), fields={n: np.delete(v, 4) for n, v in s.fields.items()})

    edit_log(without_one)(new)
    rows = moved(compared(base, new))
    assert {(row.worst.place, row.worst.new, row.differing) for row in rows} == {("t = 0.04 s", ABSENT, 1)}


def test_a_damaged_log_is_different(base: Path, new: Path) -> None:
    (new / LOG).write_bytes((new / LOG).read_bytes()[:-100])
    log = only(compared(base, new))
    assert (log.name, log.status) == ("example1/fit.mcap", Status.DIFFERENT)
    assert log.notes[0].startswith("cannot be read in NEW: ")


def test_a_metric_that_is_no_number_is_no_json(base: Path, new: Path) -> None:
    metric(nlml=math.nan)(new)
    row = only(compared(base, new))
    assert (row.name, row.status) == ("example1/metrics.json", Status.DIFFERENT)
    assert row.notes[0].startswith("cannot be read in NEW: ")
