"""Tables come back as they were written, to the last bit, by readers that are not ours."""

import csv
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet
import pytest

from tests.trackably.exports.references import EVERY, on_window

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


def test_a_parquet_file_comes_back_with_units(tmp_path: Path) -> None:
    path = on_window().to_parquet(tmp_path / "r.parquet", units=UNITS)
    table = pyarrow.parquet.read_table(path)
    assert table.column_names == HEADS
    assert [(field.metadata or {}).get(b"unit") for field in table.schema] == [b"s", b"m", None, b"N"]
    assert table.schema.metadata[b"trackably"].decode() == on_window().certificate.explanation
    of_csv = pd.read_csv(on_window().to_csv(tmp_path / "r.csv", units=UNITS))
    pd.testing.assert_frame_equal(pd.read_parquet(path), of_csv, check_exact=True)
