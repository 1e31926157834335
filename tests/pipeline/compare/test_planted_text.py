"""One change is planted in a notebook or a sentence in each test."""

from pathlib import Path

import pytest

from tests.pipeline.compare.project import (
    RESULTS,
    compared,
    edit_json,
    edit_text,
    only,
)


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


@pytest.mark.parametrize("of_new", ["theorem of 9 samples, not checked by Coq", ""])
def test_what_coq_has_proved_of_other_bits_is_not_compared(base: Path, new: Path, of_new: str) -> None:
    for root, text in ((base, "theorem of 7 samples, checked by Coq"), (new, of_new)):
        output = {"output_type": "stream", "name": "stdout", "text": text}
        cell = {"cell_type": "code", "id": "cell-9", "metadata": {}, "source": "theorem", "outputs": [output]}
        edit_json(root / "notebooks/example1.ipynb", lambda notebook, cell=cell: notebook["cells"].append(cell))
    assert compared(base, new).within


def test_a_new_cell_of_prose_moves_no_output(base: Path, new: Path) -> None:
    prose = {"cell_type": "markdown", "id": "cell-9", "metadata": {}, "source": "More prose"}
    edit_json(new / "notebooks/example1.ipynb", lambda notebook: notebook["cells"].insert(0, prose))
    assert compared(base, new).within


def test_results_alone_are_compared_without_notebooks(base: Path, new: Path) -> None:
    comparison = compared(base, new / "data/results")
    assert comparison.within
    assert comparison.notes == ("notebooks are not compared: one side has none",)


@pytest.mark.parametrize(("changed", "place"), [("0.29731", "sound.said, number 2"), ("0.2974 more", "sound.said")])
def test_numbers_of_a_sentence_are_numbers(base: Path, new: Path, changed: str, place: str) -> None:
    for root, end in ((base, "0.2973"), (new, changed)):
        edit_json(root / RESULTS / "metrics.json", lambda m, end=end: m["sound"].update(said=f"at 0.5 s by {end}"))
    assert only(compared(base, new)).worst[0].place == place


def test_numbers_of_a_sentence_may_move_by_rounding(base: Path, new: Path) -> None:
    for root, time in ((base, "0.2812170167227962"), (new, "0.2812170167239515")):
        edit_json(root / RESULTS / "metrics.json", lambda m, time=time: m["sound"].update(said=f"at {time} s"))
    assert compared(base, new).within
