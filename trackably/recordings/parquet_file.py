"""Read recordings from Parquet files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from trackably.errors import InputError
from trackably.extras import optional
from trackably.files import path_of
from trackably.recordings.clocks import Clock, Origin
from trackably.recordings.recording import Recording
from trackably.recordings.rows import Repair
from trackably.recordings.tables import LARGEST, Column, Reading, Table, is_none, recording_of


def read_parquet(
    path: str | Path,
    time: str | None,
    time_unit: str | Clock,
    signals: Mapping[str, Column | str],
    repairs: Sequence[Repair | str] = (),
    origin: Origin = None,
) -> Recording:
    """Read signals from a Parquet file; cells without a value (null, NaN) are left out and reported.

    Parameters
    ----------
    path
        The file.
    time
        The name of the column of time stamps; None counts rows, as in `read_csv`.
    time_unit
        As in `read_csv`, for stamps that are numbers. For columns of a date and time type: "ISO 8601".
    signals, repairs, origin
        As in `read_csv`.

    Warns
    -----
    DoubtfulInputWarning
        As in `read_csv`.

    Raises
    ------
    InputError
        For a file that cannot be read, if pyarrow is not installed, and for any error in the file that no repair
        removes; names file and row, counted from 1.
    TypeError, ValueError
        For a wrong argument, before anything is read.
    """
    reading = Reading(time, time_unit, signals, repairs, origin)
    wanted = reading.names
    path = path_of("path", path)
    with optional(f"{path}: Parquet"):
        from pyarrow import ArrowException, parquet, timestamp, types  # noqa: PLC0415
    try:
        schema = parquet.read_schema(path)
        if missing := [name for name in wanted if name not in schema.names]:
            listed = ", ".join(map(repr, schema.names))
            raise InputError(f"{path}: there is no column {missing[0]!r}; there are {listed}")
        if _size(parquet.read_metadata(path), wanted) > LARGEST:
            raise InputError(f"{path}: its columns unpack to more than {LARGEST} bytes: split the file")
        table = parquet.read_table(path, columns=wanted)
    except (ArrowException, OSError) as error:
        raise InputError(f"{path}: cannot be read as Parquet ({error})") from error
    if not table.num_rows:
        raise InputError(f"{path}: there are no rows")
    columns = {}
    for name, column in zip(table.column_names, table.columns, strict=True):
        if types.is_duration(column.type):
            raise InputError(
                f"{path}, column {name!r}: it holds durations; save them as numbers (in pandas: .dt.total_seconds())"
            )
        is_date = types.is_timestamp(column.type) or types.is_date(column.type)
        cells = column.cast("timestamp[ns]").cast(timestamp("ns", "UTC")).cast("string") if is_date else column
        columns[name] = [None if is_none(cell) else cell for cell in cells.to_pylist()]
    return recording_of((reading, Table(str(path), [f"row {row}" for row in range(1, table.num_rows + 1)], columns)))


def _size(metadata: Any, wanted: Sequence[str]) -> int:
    """Return the unpacked size of these columns in bytes: as stored, plus 8 for each cell."""
    groups = (metadata.row_group(i) for i in range(metadata.num_row_groups))
    parts = (group.column(j) for group in groups for j in range(group.num_columns))
    stored = sum(part.total_uncompressed_size for part in parts if part.path_in_schema.split(".")[0] in wanted)
    return int(stored + 8 * metadata.num_rows * len(wanted))
