"""Read recordings from Parquet files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import timedelta
from decimal import Decimal
from pathlib import Path
from typing import Any

from trackably.errors import InputError
from trackably.extras import optional
from trackably.recordings.clocks import Clock, DateTimes, Origin, exact, origin_seconds
from trackably.recordings.recording import Recording
from trackably.recordings.rows import Repair
from trackably.recordings.tables import (
    LARGEST,
    Cells,
    Column,
    Form,
    TableReading,
    date_in_text,
    is_none,
    path_given,
    recording_of,
)


def read_parquet(
    path: str | Path,
    time: str,
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
        The name of the column of time stamps.
    time_unit
        As in `read_csv`, for stamps that are numbers. For columns of a date and time type: "ISO 8601".
    signals, repairs, origin
        As in `read_csv`.

    Warns
    -----
    DoubtfulInputWarning
        For implausible stamps, and if `average_repeated` averages values at one time that differ by more than noise
        explains.

    Raises
    ------
    InputError
        For a file that cannot be read, if pyarrow is not installed, and for any error in the file that no repair
        removes; names file and row, counted from 1.
    """
    return recording_of(parquet_table(path, time, time_unit, signals, repairs, origin))


def parquet_table(
    path: str | Path,
    time: str,
    time_unit: str | Clock,
    signals: Mapping[str, Column | str],
    repairs: Sequence[Repair | str],
    origin: Origin,
    also: Sequence[str] = (),
) -> tuple[TableReading, Cells]:
    """Return the arguments of `read_parquet`, checked, and the cells of its columns and those in `also`.

    Raises InputError.
    """
    if not isinstance(time, str):
        raise InputError(f"time: expected the name of a column, got {time!r}")
    form = Form("column", is_none, _count, _date, lambda _: "")
    file = path_given(path)
    reading = TableReading.of(str(file), form, time, time_unit, signals, repairs, origin)
    return reading, read_cells(file, [*dict.fromkeys((*reading.names, *also))])


def read_cells(path: Path, names: Sequence[str]) -> Cells:
    """Read columns. InputError: the file is unreadable, a column is missing, or pyarrow is not installed."""
    with optional(f"{path}: Parquet"):
        from pyarrow import ArrowException, parquet, types  # noqa: PLC0415
    try:
        schema = parquet.read_schema(path)
        if missing := [name for name in names if name not in schema.names]:
            listed = ", ".join(map(repr, schema.names))
            raise InputError(f"{path}: there is no column {missing[0]!r}; there are {listed}")
        if _size(parquet.read_metadata(path), names) > LARGEST:
            raise InputError(f"{path}: its columns unpack to more than {LARGEST} bytes")
        table = parquet.read_table(path, columns=list(names))
    except (ArrowException, OSError) as error:
        raise InputError(f"{path}: cannot be read as Parquet ({error})") from error
    if not table.num_rows:
        raise InputError(f"{path}: there are no rows")
    is_date = [types.is_timestamp(of.type) or types.is_date(of.type) for of in table.schema]
    columns = {
        name: _nanoseconds(column) if has_dates else column.to_pylist()
        for name, column, has_dates in zip(table.column_names, table.columns, is_date, strict=True)
    }
    return Cells(columns, [f"row {row}" for row in range(1, table.num_rows + 1)])


def _size(metadata: Any, wanted: Sequence[str]) -> int:
    """Return the unpacked size of these columns in bytes: as stored, plus 8 for each cell."""
    groups = (metadata.row_group(i) for i in range(metadata.num_row_groups))
    parts = (group.column(j) for group in groups for j in range(group.num_columns))
    stored = sum(part.total_uncompressed_size for part in parts if part.path_in_schema.split(".")[0] in wanted)
    return int(stored + 8 * metadata.num_rows * len(wanted))


@dataclass(frozen=True)
class _Instant:
    """A stamp of a date and time type, in nanoseconds since 1970, UTC."""

    nanoseconds: int


def _nanoseconds(column: Any) -> list[_Instant | None]:
    counts: list[int | None] = column.cast("timestamp[ns]").cast("int64").to_pylist()
    return [None if count is None else _Instant(count) for count in counts]


def _date(clock: DateTimes, cell: object) -> Decimal:
    return origin_seconds(cell.nanoseconds) if isinstance(cell, _Instant) else date_in_text(clock, cell)


def _count(cell: object) -> Decimal:
    match cell:
        case _Instant():
            raise ValueError('the column holds dates: "ISO 8601" is their time unit')
        case timedelta():
            raise ValueError("the column holds durations: save them as numbers (in pandas: .dt.total_seconds())")
    return exact(cell)
