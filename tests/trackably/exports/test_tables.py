"""Tables come back as they were written, to the last bit, by readers that are not ours."""

import csv
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet
import pytest

from tests.trackably.exports.references import EVERY, on_window
from trackably import Column, read_csv

every = pytest.mark.parametrize("name", EVERY)
UNITS = {"position": "m", "force": "N"}
HEADS = ["time [s]", "position [m]", "velocity", "force [N]"]


@every
def test_a_csv_file_comes_back(name: str, tmp_path: Path) -> None:
    reference = EVERY[name]()
    path = reference.to_csv(tmp_path / "r.csv", 2, 9)
    with path.open(newline="", encoding="utf-8") as file:
        head, *rows = list(csv.reader(file))
    k, system = np.arange(2.0, 11.0), reference.reference.plant.system
    assert head == ["time [s]", *system.states, *system.inputs]
    read = np.array(rows, dtype=float)
    np.testing.assert_array_equal(read[:, 0], k * system.sampling_time)
    np.testing.assert_array_equal(read[:, 1:], np.hstack([reference.reference.state(k), reference.reference.input(k)]))


def test_units_stand_in_the_header(tmp_path: Path) -> None:
    frame = pd.read_csv(on_window().to_csv(tmp_path / "r.csv", units=UNITS))
    assert [*frame] == HEADS
    np.testing.assert_array_equal(frame["position [m]"], on_window().state(np.arange(61.0))[:, 0])
    recording = read_csv(
        tmp_path / "r.csv", time="time [s]", time_unit="s", signals={"position": Column("position [m]")}
    )
    np.testing.assert_array_equal(recording.samples("position").values, frame["position [m]"])


def test_a_parquet_file_comes_back_with_units(tmp_path: Path) -> None:
    path = on_window().to_parquet(tmp_path / "r.parquet", units=UNITS)
    table = pyarrow.parquet.read_table(path)
    assert table.column_names == HEADS
    assert [(field.metadata or {}).get(b"unit") for field in table.schema] == [b"s", b"m", None, b"N"]
    assert table.schema.metadata[b"trackably"].decode() == on_window().certificate.explanation
    of_csv = pd.read_csv(on_window().to_csv(tmp_path / "r.csv", units=UNITS))
    pd.testing.assert_frame_equal(pd.read_parquet(path), of_csv, check_exact=True)


def test_what_cannot_be_written_is_refused(tmp_path: Path) -> None:
    for write in (on_window().to_csv, on_window().to_parquet):
        with pytest.raises(ValueError, match=r"^t = 3.05 s is outside of what is proved"):
            write(tmp_path / "r", 0, 62)
        with pytest.raises(ValueError, match=r"^units: speed is neither a state nor an input"):
            write(tmp_path / "r", units={"speed": "m/s"})
        with pytest.raises(ValueError, match=r"^units: expected a unit such as m/s for force, got ']'"):
            write(tmp_path / "r", units={"force": "]"})
        with pytest.raises(TypeError, match=r"^units: force: expected a text"):
            write(tmp_path / "r", units={"force": 1})
        with pytest.raises(ValueError, match="count must be at least 1"):
            write(tmp_path / "r", count=0)
    assert list(tmp_path.iterdir()) == []
