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
    with pytest.raises(InputError, match=r'"ISO 8601" as time unit reads .* dates of Parquet'):
        read_parquet(path, "t", DateTimes("%d.%m.%Y"), {"x": "y"})


def test_durations_are_refused(tmp_path):
    path = written(tmp_path, [timedelta(seconds=k) for k in range(3)], pa.duration("us"))
    with pytest.raises(InputError, match=r"column 't': it holds durations; save them as numbers \(in pandas: \.dt\."):
        read_parquet(path, "t", "s", {"x": "y"})


def test_a_column_of_lists_is_refused(tmp_path):
    path = tmp_path / "lists.parquet"
    pq.write_table(pa.table({"t": [0.0, 1.0], "q": [[0.0, 1.0], [2.0, 3.0]]}), path)
    with pytest.raises(InputError, match=r"row 1, column 'q': expected a finite number, got \[0\.0, 1\.0\]"):
        read_parquet(path, "t", "s", {"x": "q"})
