"""Recordings of breathing, with all their dirt: a file written here, and real ones where they are at hand."""

from pathlib import Path

import pytest

from trackably.recordings import (
    Column,
    CsvLayout,
    Finding,
    Recording,
    Repair,
    drop_rows_out_of_order,
    drop_zero_rows,
    keep_first_of_repeated,
    read_csv,
)

COMMAS = CsvLayout(decimal=",")
MARKER = {axis: Column(axis, scale=1e-3) for axis in "xyz"}

DIRTY = """\
"Frame";"Timestamp";"x";"y";"z"
0;0;-484,4;3;66,1
6;100;-484,6;2,6;65,5
12;200;-485;2,3;65
18;25,6;-485,2;2;64,5
24;433;-485,5;1,8;64,2
30;433;-485,7;1,6;64
36;500;-485,6;1,4;64,1
0;0;0;0;0
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "breathing.csv"
    path.write_bytes(DIRTY.replace("\n", "\r\n").encode())
    return path


def read(path: Path, *repairs: Repair) -> Recording:
    return read_csv(path, "Timestamp", "ms", MARKER, COMMAS, repairs)


def test_dirt_is_counted(path: Path) -> None:
    recording = read(path, drop_zero_rows, drop_rows_out_of_order, keep_first_of_repeated)
    for axis, values in {
        "x": [-0.4844, -0.4846, -0.485, -0.4855, -0.4856],
        "y": [0.003, 0.0026, 0.0023, 0.0018, 0.0014],
        "z": [0.0661, 0.0655, 0.065, 0.0642, 0.0641],
    }.items():
        assert recording[axis].times.tolist() == [0.0, 0.1, 0.2, 0.433, 0.5]
        assert recording[axis].values.tolist() == values
    assert recording.cleanings[0].rows == 8
    assert recording.cleanings[0].findings == (
        Finding("zero in every signal, dropped", 1, "line 9"),
        Finding("out of order, dropped", 1, "line 5"),
        Finding("time repeated, first kept", 1, "line 7"),
    )
