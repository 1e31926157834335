"""Columns of Parquet files that hold dates are read, and those that hold durations are refused."""

from datetime import date, timedelta

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from trackably import InputError, read_parquet
from trackably.recordings import DateTimes


def written(folder, times, kind):
    path = folder / "a.parquet"
    pq.write_table(pa.table({"t": pa.array(times).cast(kind), "y": np.arange(float(len(times)))}), path)
    return path


@pytest.mark.parametrize("kind", [pa.date32(), pa.timestamp("ms")])
def test_days_are_midnights(tmp_path, kind):
    path = written(tmp_path, [date(2024, 5, day) for day in (1, 2, 5)], kind)
    assert read_parquet(path, "t", "ISO 8601", {"x": "y"})["x"].times.tolist() == [0.0, 86_400.0, 345_600.0]
    with pytest.raises(InputError, match='have the unit "ISO 8601"'):
        read_parquet(path, "t", "s", {"x": "y"})
    with pytest.raises(InputError, match=r'"ISO 8601" as time unit reads .* dates of Parquet; .* six digits'):
        read_parquet(path, "t", DateTimes("%d.%m.%Y"), {"x": "y"})


def test_durations_are_refused(tmp_path):
    path = written(tmp_path, [timedelta(seconds=k) for k in range(3)], pa.duration("us"))
    with pytest.raises(InputError, match=r"column 't': it holds durations; save them as numbers \(in pandas: \.dt\."):
        read_parquet(path, "t", "s", {"x": "y"})


REFUSED = [
    ([0.0, 1.0], [[0.0, 1.0], [2.0, 3.0]], r"row 1, column 'q': expected a finite number, got \[0\.0, 1\.0\]"),
    ([0.0, 1.0], ["0.125", "2"], r"got '0\.125' \(a text: save it as a number\)"),
    ([0.3, 0.1], [1.0, 2.0], r"got 0\.1 s after 0\.3 s"),
]


@pytest.mark.parametrize(("times", "values", "message"), REFUSED)
def test_other_columns_are_refused(tmp_path, times, values, message):
    path = tmp_path / "a.parquet"
    pq.write_table(pa.table({"t": times, "q": values}), path)
    with pytest.raises(InputError, match=message):
        read_parquet(path, "t", "s", {"x": "q"})
