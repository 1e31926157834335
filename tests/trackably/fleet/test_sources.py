"""Where recordings come from: files, tables with a column of names, topics."""

from pathlib import Path

import pytest
from pyarrow import csv, parquet

from trackably import Recording, parts_of_csv, parts_of_parquet, read_csv, recordings_in
from trackably.errors import InputError

TABLE = """who,t,x
left,0.0,1.5
right,0.0,-1
left,0.1,2.5
right,0.25,-2
"""


def read(path: Path) -> Recording:
    return read_csv(path, "t", "s", {"position": "x"})


def numbers(recording: object) -> tuple[list[float], list[float]]:
    assert isinstance(recording, Recording)
    samples = recording.samples("position")
    return samples.times.tolist(), samples.values.tolist()


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("a.csv", "b.csv", "deeper/a.csv"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("t,x\n0,1\n1,2\n")
    (tmp_path / ".hidden.csv").write_text("")
    (tmp_path / "notes.txt").write_text("")
    return tmp_path


def test_a_folder_or_a_pattern_names_its_files(folder):
    assert [s.name for s in recordings_in(folder / "*.csv", read)] == ["a", "b"]
    assert [s.name for s in recordings_in(str(folder / "**" / "*.csv"), read)] == ["a", "b", "deeper/a"]
    assert [s.name for s in recordings_in(folder, read)] == ["a", "b", "notes"]
    assert [s.name for s in recordings_in(folder / "a.csv", read)] == ["a"]
    assert numbers(recordings_in(folder / "*.csv", read)[0].read()) == ([0, 1], [1, 2])


@pytest.mark.parametrize("parts_of", [parts_of_csv, parts_of_parquet])
def test_parts_of_a_table_are_what_separate_files_would_be(tmp_path, parts_of):
    (tmp_path / "table").write_text(TABLE)
    if parts_of is parts_of_parquet:
        parquet.write_table(csv.read_csv(tmp_path / "table"), tmp_path / "table")
    left, right = parts_of(tmp_path / "table", "who", "t", "s", {"position": "x"})
    assert (left.name, right.name) == ("left", "right")
    assert numbers(left.read()) == ([0, 0.1], [1.5, 2.5])
    assert numbers(right.read()) == ([0, 0.25], [-1, -2])


def test_a_wrong_cell_spoils_its_own_part_and_names_the_line(tmp_path):
    (tmp_path / "all.csv").write_text(TABLE.replace("-2", "two"))
    left, right = parts_of_csv(tmp_path / "all.csv", "who", "t", "s", {"position": "x"})
    assert numbers(left.read()) == ([0, 0.1], [1.5, 2.5])
    with pytest.raises(InputError, match="line 5, column 'x'"):
        right.read()
