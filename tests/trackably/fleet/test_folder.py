"""Folders of recordings: names map one to one, one name spoils nothing for others, and what is loaded is the row's."""

import csv
import re
import shutil
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyarrow import parquet

from tests.trackably.fleet.recordings import TWO_MOTIONS, learned, unreadable
from trackably import Fleet, Samples, Source, TrackableReference
from trackably.errors import InputError
from trackably.files import from_json, to_json
from trackably.fleet.folder import FleetFolder, printable

FILES = ("row.json", "reference.json", "certificate.json", "certificate.at1.json", "counterexample.json", "fleet.csv")
PIECES = (
    *("run 1", "%2F", "^1", "~1", "con", "NUL.txt", "lpt1", "ss", "e\u0301", *"xXa/%^. \\:*\n\0='"),
    *FILES,
    *"\u00e9\u212a\u0131\u00df\u202e\udcc3\udca9\U0001f916",
)
NAMES = st.lists(st.sampled_from(PIECES) | st.text(st.characters(), max_size=3), min_size=1, max_size=5).map("".join)


def folder_of(name: str) -> str:
    return FleetFolder(Path("fleet")).of(name).as_posix().removeprefix("fleet/")


@given(st.lists(NAMES, min_size=2, max_size=9, unique=True))
def test_names_have_folders_of_their_own_on_every_file_system(names):
    """And none is a file of the fleet, or has one as a part."""
    folders = {folder_of(name) for name in names}
    assert len(folders) == len(names)
    for part in "/".join(folders).split("/"):
        assert re.fullmatch(r"(?!(con|lpt1)\Z)[a-z0-9_~-]+( [a-z0-9_~-]+)*", part)


def test_a_name_that_cannot_be_a_folder_is_a_row(tmp_path):
    tmp_path.joinpath("taken").write_text("a file of somebody's")
    bad = ("x" * 300, "/".join(["x" * 200] * 30), "taken", "taken/too")
    fleet = learned([Source(name, unreadable) for name in ("first", *bad, "last")], tmp_path)
    told = [row.sentence.startswith("give it another name: its folder") for row in fleet.rows]
    assert told == [False, True, True, True, True, False]
    assert tmp_path.joinpath("taken").read_text() == "a file of somebody's"


@pytest.mark.parametrize("harm", ["another's", "another row", "missing"])
def test_what_is_loaded_is_what_the_row_says(two, tmp_path, harm):
    shutil.copytree(two.folder, tmp_path, dirs_exist_ok=True)
    fleet, path = Fleet(tmp_path, two.rows), tmp_path / "run 0" / "reference.json"
    assert isinstance(fleet.reference("run 0"), TrackableReference)
    if harm == "another's":
        shutil.copyfile(tmp_path / "run 1" / "reference.json", path)
    elif harm == "another row":
        row: Any = from_json((tmp_path / "run 0" / "row.json").read_bytes())
        (tmp_path / "run 0" / "row.json").write_bytes(to_json({**row, "fingerprint": two.rows[1].fingerprint}))
        fleet = learned(TWO_MOTIONS, tmp_path)
    else:
        path.unlink()
    with pytest.raises(InputError, match=r"reference\.json: (was changed since the row|there is no such file)"):
        fleet.reference("run 0")
    assert isinstance(fleet.reference("run 1"), TrackableReference)


RUN = ["=1+1", "+1", "-1", "@SUM(A1)", "\t=1", "\r=1", "\n=1", "'=1", "''=1", "\uff1d1", '=HYPERLINK("x","y")', "a=1"]


def test_no_cell_of_the_table_is_a_formula_and_names_are_still_told_apart(tmp_path):
    def broken() -> Samples:
        raise InputError('=cmd|" /C calc"!A0')

    fleet = learned([Source(name, broken) for name in RUN], tmp_path)
    with fleet.table.open(encoding="utf-8", newline="") as file:
        header, *cells = csv.reader(file)
    assert [row[0].removeprefix("'") for row in cells] == [*map(printable, RUN)]
    assert not any(re.match("[=+@\t\r\n\uff0b\uff0d\uff1d\uff20-]", cell) for row in cells for cell in row)
    assert cells[0][header.index("sentence")] == "'" + fleet.rows[0].sentence


def test_names_from_elsewhere_print_as_lines_and_stand_in_every_table(tmp_path):
    """Topics may hold anything: a terminal is sent no control characters, and the lines stay lines."""
    names = ["a\nproved: all", "\x1b[2J", "\u202eb", "\udcff"]
    fleet = learned([Source(name, unreadable) for name in names], tmp_path)
    lines = str(fleet).splitlines()
    assert all(map(str.isprintable, lines))
    assert len(lines) == 1 + len(names)
    fleet.to_parquet(tmp_path / "fleet.parquet")
    assert parquet.read_table(tmp_path / "fleet.parquet").to_pydict() == fleet.columns()
    assert fleet.columns()["name"] == [*map(printable, names)]
