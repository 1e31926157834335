"""Where recordings come from: files, tables with a column of names, topics."""

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from mcap.writer import Writer
from pyarrow import parquet

from trackably import (
    Column,
    Field,
    Recording,
    parts_of_csv,
    parts_of_parquet,
    read_csv,
    read_mcap,
    read_parquet,
    recordings_in,
    topics_of,
)
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


def test_endings_tell_files_apart_that_have_one_name(tmp_path):
    for name in ("a.csv", "a.txt"):
        (tmp_path / name).write_text("")
    assert [s.name for s in recordings_in(tmp_path, read)] == ["a.csv", "a.txt"]


def test_no_file_is_an_error_of_its_own(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        recordings_in(tmp_path / "*.csv", read)


def test_parts_of_a_table_are_what_separate_files_would_be(tmp_path):
    (tmp_path / "all.csv").write_text(TABLE)
    left, right = parts_of_csv(tmp_path / "all.csv", "who", "t", "s", {"position": "x"})
    assert (left.name, right.name) == ("left", "right")
    assert numbers(left.read()) == ([0, 0.1], [1.5, 2.5])
    assert numbers(right.read()) == ([0, 0.25], [-1, -2])


def test_a_wrong_cell_spoils_its_own_part_and_names_the_line(tmp_path):
    (tmp_path / "all.csv").write_text(TABLE.replace("-2", "two"))
    left, right = parts_of_csv(tmp_path / "all.csv", "who", "t", "s", {"position": "x"})
    assert numbers(left.read()) == ([0, 0.1], [1.5, 2.5])
    with pytest.raises(InputError, match="line 5, column 'x'"):
        right.read()


def test_a_row_without_a_name_is_refused(tmp_path):
    (tmp_path / "all.csv").write_text(TABLE + ",1,2\n")
    with pytest.raises(InputError, match="line 6, column 'who'"):
        parts_of_csv(tmp_path / "all.csv", "who", "t", "s", {"position": "x"})


def written(path: Path, **columns: object) -> Path:
    parquet.write_table(pa.table(columns), path)
    return path


def test_parquet_says_what_the_same_table_says_as_csv(tmp_path):
    (tmp_path / "all.csv").write_text(TABLE)
    file = written(
        tmp_path / "all.parquet",
        who=["left", "right", "left", "right"],
        t=[0.0, 0.0, 0.1, 0.25],
        x=[1.5, -1.0, 2.5, -2.0],
    )
    csv = parts_of_csv(tmp_path / "all.csv", "who", "t", "s", {"position": "x"})
    table = parts_of_parquet(file, "who", "t", "s", {"position": "x"})
    assert [(s.name, numbers(s.read())) for s in table] == [(s.name, numbers(s.read())) for s in csv]


def test_stamps_of_a_date_type_count_from_the_first_sample(tmp_path):
    when = [datetime(2026, 5, 1, 12, 0, s, 250_000, tzinfo=UTC) for s in (0, 1, 3)]
    file = written(tmp_path / "a.parquet", t=when, x=[1.0, None, 3.0])
    recording = read_parquet(file, "t", "ISO 8601", {"position": "x"})
    assert numbers(recording) == ([0, 3], [1, 3])
    assert recording.absolute
    with pytest.raises(InputError, match="ISO 8601"):
        read_parquet(file, "t", "s", {"position": "x"})


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        ({"t": [0.0, 1.0], "y": [1.0, 2.0]}, "no column 'x'; there are 't', 'y'"),
        ({"t": [0.0, 1.0], "x": ["a", "b"]}, "row 1, column 'x': expected a finite number"),
        ({"t": [1.0, 0.0], "x": [1.0, 2.0]}, "row 2: times must not decrease"),
        ({"t": [0.0, 1.0], "x": [1.0, np.inf]}, "row 2, column 'x'"),
        ({"t": pa.array([], pa.float64()), "x": pa.array([], pa.float64())}, "there are no rows"),
    ],
)
def test_what_is_wrong_in_parquet_is_named(tmp_path, columns, said):
    with pytest.raises(InputError, match=said):
        read_parquet(written(tmp_path / "a.parquet", **columns), "t", "s", {"position": "x"})


def test_a_file_that_is_no_parquet_is_named(tmp_path):
    (tmp_path / "a.parquet").write_text("t,x\n")
    with pytest.raises(InputError, match=r"a\.parquet: cannot be read as Parquet"):
        read_parquet(tmp_path / "a.parquet", "t", "s", {"position": "x"})


@pytest.fixture
def log(tmp_path: Path) -> Path:
    with (tmp_path / "log.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start()
        for name, scale in (("left", 1.0), ("right", -1.0), ("far/right", 2.0)):
            channel = writer.register_channel(f"/{name}/pose", "json", 0)
            for i in range(3):
                data = f'{{"x": {scale * i}}}'.encode()
                writer.add_message(channel, 10**9 * (5 + i), data, 10**9 * (5 + i))
        writer.register_channel("/left/other", "json", 0)
        writer.finish()
    return tmp_path / "log.mcap"


def test_topics_with_a_name_in_them_are_recordings(log):
    found = topics_of(log, {"position": Field("/{name}/pose", "x")})
    assert [source.name for source in found] == ["far/right", "left", "right"]
    alone = read_mcap(log, {"position": Field("/right/pose", "x")})
    assert numbers(found[2].read()) == numbers(alone) == ([0, 1, 2], [0, -1, -2])


def test_topics_that_are_missing_are_named(log):
    with pytest.raises(InputError, match=r"no topics /\{name\}/speed; there are"):
        topics_of(log, {"position": Field("/{name}/speed", "x")})
    with pytest.raises(InputError, match=r"expected \{name\} once in each topic"):
        topics_of(log, {"position": Field("/left/pose", "x")})


def test_offsets_are_added_after_the_scale_to_values_alone(tmp_path):
    """CSV, Parquet and MCAP alike; noise has no offset."""
    (tmp_path / "t.csv").write_text("t,x,s\n0,64.5,3\n1,-0.75,3\n")
    table = pa.table({"t": [0.0, 1.0], "x": [64.5, -0.75], "s": [3.0, 3.0]})
    parquet.write_table(table, tmp_path / "t.parquet")
    path = tmp_path / "t.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        channel = writer.register_channel("/x", "json", writer.register_schema("x", "jsonschema", b"{}"))
        for t, x in ((0, 64.5), (10**9, -0.75)):
            writer.add_message(channel, log_time=t, publish_time=t, data=b'{"x": %a, "s": 3}' % x)
        writer.finish()
    column = {"position": Column("x", 1e-3, "s", offset=-0.012)}
    for found in (
        read_csv(tmp_path / "t.csv", "t", "s", column),
        read_parquet(tmp_path / "t.parquet", "t", "s", column),
        read_mcap(path, {"position": Field("/x", "x", 1e-3, noise_std="s", offset=-0.012)}),
    ):
        assert found["position"].values.tolist() == [0.0525, -0.01275]
        assert found["position"].noise_std.tolist() == [0.003, 0.003]
