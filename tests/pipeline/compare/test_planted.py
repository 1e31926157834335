"""One change is planted in each test; the comparison has to say where it is, and how large."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from pipeline.compare.claims import Claims
from pipeline.compare.comparison import compare
from pipeline.compare.model import ABSENT, Comparison, Status
from pipeline.storage.logs import Series
from tests.pipeline.compare.project import (
    TOLERANCES,
    compared,
    edit_json,
    edit_log,
    edit_text,
    moved,
    only,
    with_sample,
)

RESULTS = Path("data/results/example1")


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


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("k_bar,bound\n80,\n82,0.5\n81,0.7\n83,0.4\n", "'k_bar = 81' of BASE has another place"),
        ("bound,k_bar\n,80\n0.7,81\n0.5,82\n0.4,83\n", "the same columns in another order"),
    ],
    ids=["rows", "columns"],
)
def test_a_reordered_table(base: Path, new: Path, text: str, said: str) -> None:
    (new / RESULTS / "iterations.csv").write_text(text)
    row = only(compared(base, new))
    assert (row.artifact, row.status, row.differing) == ("example1/iterations.csv", Status.DIFFERENT, 0)
    assert said in row.notes[0]


def test_rows_without_names_of_their_own_are_reordered_too(base: Path, new: Path) -> None:
    (base / RESULTS / "iterations.csv").write_text("k,x\n1,2\n1,3\n")
    (new / RESULTS / "iterations.csv").write_text("k,x\n1,3\n1,2\n")
    assert only(compared(base, new)).notes == ("reordered: the same rows in another order",)


def test_a_cell_and_a_row(base: Path, new: Path) -> None:
    edit_text(new / RESULTS / "iterations.csv", "82,0.5\n83,0.4\n", "82,0.51\n")
    row = only(compared(base, new))
    assert [(d.place, d.new) for d in row.worst] == [
        ("column k_bar, k_bar = 83", ABSENT),
        ("column bound, k_bar = 83", ABSENT),
        ("column bound, k_bar = 82", 0.51),
    ]


def test_a_nan_in_each_kind_of_artifact(base: Path, new: Path) -> None:
    edit_json(new / RESULTS / "metrics.json", lambda m: m["sound"].update(nlml=math.nan))
    edit_text(new / RESULTS / "iterations.csv", "82,0.5", "82,nan")
    edit_log(new / RESULTS / "fit.mcap", lambda s: with_sample(s, "value", 3, math.nan) if s.topic == "/samples" else s)
    rows = moved(compared(base, new))
    assert [(row.name, row.worst[0].place) for row in rows] == [
        ("example1/fit.mcap /samples value", "t = 0.03 s"),
        ("example1/iterations.csv", "column bound, k_bar = 82"),
        ("example1/metrics.json", "sound.nlml"),
    ]
    for row in rows:
        value = row.worst[0].new
        assert isinstance(value, float)
        assert math.isnan(value)
        assert (row.worst[0].absolute, row.worst[0].excess, row.beyond) == (None, math.inf, 1)


def test_a_recoloured_figure(base: Path, new: Path) -> None:
    edit_text(new / RESULTS / "figures/margins.svg", "#d55e00", "#0072b2")
    row = only(compared(base, new))
    worst = row.worst[0]
    assert (row.artifact, row.beyond) == ("example1/figures/margins.svg", 1)
    assert (worst.place, worst.base, worst.new) == ("axes_1/line2d_1/path[1]: style stroke", "#d55e00", "#0072b2")


@pytest.mark.parametrize(
    ("old", "changed", "place"),
    [
        ("L 3 1", "L 3 1.2", "axes_1/line2d_1/path[1]: coordinate 6"),
        ("step $k$", "time", "axes_1/text_1/comment[1]: text"),
        (' y="122.2"/>', ' y="122.3"/>', "axes_1/use[1]: y, number 1"),
        ("L 4 2", "L 4 2 L 9 2", "axes_1/line2d_1/path[1]: distance between the outlines"),
        ('<g id="line2d_1">', '<g id="line2d_2">', "axes_1/line2d_1: id"),
    ],
)
def test_a_redrawn_figure(base: Path, new: Path, old: str, changed: str, place: str) -> None:
    edit_text(new / RESULTS / "figures/margins.svg", old, changed)
    assert only(compared(base, new)).worst[0].place == place


@pytest.mark.parametrize(
    ("old", "changed"),
    [("L 2 2", "L 2.001 2"), ("M 1 1 L 2 2", "M 1 1 L 1.5 1.5 L 2 2"), ("m0772998e1b", "mffffffffff")],
    ids=["rounding", "a point on a line", "a name by hash"],
)
def test_a_figure_that_looks_the_same(base: Path, new: Path, old: str, changed: str) -> None:
    edit_text(new / RESULTS / "figures/margins.svg", old, changed)
    assert compared(base, new).within


def test_a_changed_picture(base: Path, new: Path) -> None:
    for root, level in ((base, 0), (new, 200)):
        pixels = np.zeros((4, 6, 3), dtype=np.uint8)
        pixels[2, 5, 1] = level
        Image.fromarray(pixels).save(root / RESULTS / "figures/landscape.png")
    worst = only(compared(base, new)).worst[0]
    assert (worst.place, worst.base, worst.new) == ("green of the pixel at column 5, row 2", 0, 200)


def test_a_failed_claim(base: Path, new: Path) -> None:
    edit_json(new / RESULTS / "metrics.json", lambda m: m["sound"].update(worst_state_margin_at_steps=-1e-9))
    comparison = compared(base, new)
    assert not moved(comparison), "the margin moved within its tolerance"
    failed = [claim for claim in comparison.claims if not claim.new.holds]
    assert [(claim.text, claim.base.holds, claim.new.found) for claim in failed] == [
        ("the state keeps its bounds", True, -1e-9)
    ]
    assert not comparison.within


def test_claims_about_tables_and_logs(base: Path, new: Path) -> None:
    edit_text(new / RESULTS / "iterations.csv", "81,0.7", "81,")
    (new / RESULTS / "fit.mcap").unlink()
    verdicts = [claim.new for claim in compared(base, new).claims]
    assert [verdict.holds for verdict in verdicts] == [True, False, False]
    assert (verdicts[1].found, verdicts[2].found) == (82, ABSENT)
    assert verdicts[2].reason == "example1/fit.mcap is not there"


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


@pytest.mark.parametrize(
    ("old", "changed", "place"),
    [
        ("0.659325", "0.659345", "cell 1, output 1, stdout, line 2, number 1"),
        ("of 7 samples", "of 8 samples", "cell 1, output 1, stdout, line 2, number 2"),
        ("learned", "failed", "cell 1, output 1, stdout, line 1"),
        ('"Table"', '"Matrix"', "cell 1, output 2, text/plain, line 1"),
    ],
)
def test_a_changed_output_of_a_notebook(base: Path, new: Path, old: str, changed: str, place: str) -> None:
    edit_text(new / "notebooks/example1.ipynb", old, changed)
    row = only(compared(base, new))
    assert (row.artifact, row.worst[0].place, row.beyond) == ("notebooks/example1.ipynb", place, 1)


def test_a_new_cell_of_prose_moves_no_output(base: Path, new: Path) -> None:
    prose = {"cell_type": "markdown", "id": "cell-9", "metadata": {}, "source": "More prose"}
    edit_json(new / "notebooks/example1.ipynb", lambda notebook: notebook["cells"].insert(0, prose))
    assert compared(base, new).within


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


def test_results_alone_are_compared_without_notebooks(base: Path, new: Path) -> None:
    comparison = compared(base, new / "data/results")
    assert comparison.within
    assert comparison.notes == ("notebooks are not compared: one side has none",)


def test_claims_may_be_about_two_values_of_the_same_results(base: Path, new: Path) -> None:
    """The mean's last value against the table's last bound: 0.9 and 0.4."""
    mean = {"file": "example1/fit.mcap", "topic": "/references/sound", "column": "mean"}
    bound = {"file": "example1/iterations.csv", "column": "bound"}
    entry = {"claim": "the mean is above its bound", "source": "own", "value": mean, "at_least": bound}
    claims = Claims.model_validate({"claims": [entry]})
    edit_text(new / RESULTS / "iterations.csv", "83,0.4", "83,0.95")
    (judged,) = compare(base, new, TOLERANCES, claims).claims
    assert (judged.base.holds, judged.new.holds) == (True, False)
    assert judged.expected == "≥ iterations.csv bound (last)"
    (new / RESULTS / "iterations.csv").unlink()
    (judged,) = compare(base, new, TOLERANCES, claims).claims
    assert (judged.new.holds, judged.new.reason) == (False, "example1/iterations.csv is not there")


@pytest.mark.parametrize(("changed", "place"), [("0.29731", "sound.said, number 2"), ("0.2974 more", "sound.said")])
def test_numbers_of_a_sentence_are_numbers(base: Path, new: Path, changed: str, place: str) -> None:
    for root, end in ((base, "0.2973"), (new, changed)):
        edit_json(root / RESULTS / "metrics.json", lambda m, end=end: m["sound"].update(said=f"at 0.5 s by {end}"))
    assert only(compared(base, new)).worst[0].place == place


def test_numbers_of_a_sentence_may_move_by_rounding(base: Path, new: Path) -> None:
    for root, time in ((base, "0.2812170167227962"), (new, "0.2812170167239515")):
        edit_json(root / RESULTS / "metrics.json", lambda m, time=time: m["sound"].update(said=f"at {time} s"))
    assert compared(base, new).within


def test_letters_of_a_figure_are_those_of_its_text(base: Path, new: Path) -> None:
    """Other digits of a number within tolerance have other outlines."""
    for root, digits in ((base, "4.480001"), (new, "4.480002")):
        glyphs = "".join(f'<use xlink:href="#DejaVuSans-{ord(digit):x}"/>' for digit in digits)
        text = f'<!-- worst {digits} --><g transform="translate(4 5)"><defs/>{glyphs}</g>'
        edit_text(root / RESULTS / "figures/margins.svg", "<!-- step $k$ -->", text)
    assert compared(base, new).within
    edit_text(new / RESULTS / "figures/margins.svg", "translate(4 5)", "translate(4 6)")
    assert only(compared(base, new)).worst[0].place == "axes_1/text_1/g[1]: transform, number 2"
