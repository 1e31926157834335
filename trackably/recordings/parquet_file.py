"""Read recordings from Parquet files."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import Any, Self, TypeVar

import numpy as np

from trackably.arrays import Array
from trackably.errors import InputError
from trackably.extras import optional
from trackably.recordings.clocks import Clock, DateTimes, Origin, checked_origin, clock_named
from trackably.recordings.csv_file import Column, column_given
from trackably.recordings.decimals import EXACT, NANOSECOND, exact, scaled
from trackably.recordings.file_kinds import LARGEST, check_mapping, path_given
from trackably.recordings.recording import Recording
from trackably.recordings.rows import Repair, Rows, chosen_repairs, recording_of_table

_T = TypeVar("_T")


def read_parquet(
    path: str | Path,
    time: str,
    time_unit: str | Clock,
    signals: Mapping[str, Column | str],
    repairs: Sequence[Repair | str] = (),
    origin: Origin = None,
) -> Recording:
    """Read signals from a Parquet file; its cells without a value (null, NaN) are left out and reported.

    Parameters
    ----------
    path
        The file.
    time
        The name of the column of time stamps.
    time_unit
        As of `read_csv`, for stamps that are numbers. Stamps of a date and time type are dates: "ISO 8601".
    signals, repairs, origin
        As of `read_csv`.

    Warns
    -----
    DoubtfulInputWarning
        For stamps that are hardly in the unit that is said, and where `average_repeated` averages values at one time
        that noise does not explain.

    Raises
    ------
    InputError
        For a file that cannot be read, where pyarrow is not installed, and for anything wrong in the file that no
        repair mends: names file and row, counted from 1.

    """
    reading = ParquetReading.of(path_given(path), time, time_unit, signals, repairs, origin)
    return reading.recording(reading.cells())


@dataclass(frozen=True)
class Cells:
    """The columns of a table, by name, as Python's values; `rows` are the numbers of the rows in the file, from 1."""

    columns: Mapping[str, Sequence[object]]
    rows: Sequence[int]

    def part(self, chosen: Sequence[int]) -> Cells:
        """Return these rows, given as positions from 0, in this order."""
        columns = {name: [column[i] for i in chosen] for name, column in self.columns.items()}
        return Cells(columns, [self.rows[i] for i in chosen])


@dataclass(frozen=True)
class ParquetReading:
    """The columns of a file with their names in the recording, its clock, and what mends its rows."""

    path: Path
    time: str
    clock: Clock
    columns: Mapping[str, Column]
    repairs: tuple[Repair, ...]
    origin: Origin

    @classmethod
    def of(
        cls,
        path: Path,
        time: str,
        time_unit: str | Clock,
        signals: Mapping[str, Column | str],
        repairs: Sequence[Repair | str],
        origin: Origin,
    ) -> Self:
        """Return the arguments of `read_parquet`, checked. InputError: one of them is wrong."""
        check_mapping(path, signals, 'a mapping from names to columns, as {"position": "x"}')
        if not isinstance(time, str):
            raise InputError(f"time: expected the name of a column, got {time!r}")
        columns = {name: column_given(name, wanted) for name, wanted in signals.items()}
        chosen = tuple(chosen_repairs(repairs))
        return cls(path, time, clock_named(time_unit), columns, chosen, checked_origin(origin))

    def cells(self, *also: str) -> Cells:
        """Return the columns that are needed, and `also` these. InputError: unreadable, or a column is missing."""
        with optional(f"{self.path}: Parquet"):
            from pyarrow import ArrowException, parquet, types  # noqa: PLC0415
        names = (self.time, *(n for c in self.columns.values() for n in (c.name, c.noise_std)), *also)
        wanted = list(dict.fromkeys(name for name in names if name is not None))
        try:
            schema = parquet.read_schema(self.path)
            if missing := [name for name in wanted if name not in schema.names]:
                listed = ", ".join(map(repr, schema.names))
                raise InputError(f"{self.path}: there is no column {missing[0]!r}; there are {listed}")
            if _size(parquet.read_metadata(self.path), wanted) > LARGEST:
                raise InputError(f"{self.path}: its columns unpack to more than {LARGEST} bytes")
            table = parquet.read_table(self.path, columns=wanted)
        except (ArrowException, OSError) as error:
            raise InputError(f"{self.path}: cannot be read as Parquet ({error})") from error
        if not table.num_rows:
            raise InputError(f"{self.path}: there are no rows")
        columns = {
            name: _nanoseconds(column) if types.is_timestamp(column.type) else column.to_pylist()
            for name, column in zip(table.column_names, table.columns, strict=True)
        }
        return Cells(columns, range(1, table.num_rows + 1))

    def recording(self, cells: Cells) -> Recording:
        """Return the recording of rows with these columns. Raises InputError; warns of stamps in another unit."""
        rows = Rows(
            str(self.path),
            [f"row {row}" for row in cells.rows],
            self._stamps(cells),
            {
                name: self._numbers(cells, column.name, column.scale, column.offset)
                for name, column in self.columns.items()
            },
            {
                name: self._numbers(cells, column.noise_std, abs(column.scale))
                for name, column in self.columns.items()
                if column.noise_std is not None
            },
        )
        return recording_of_table(rows, self.clock, self.repairs, self.origin)

    def _stamps(self, cells: Cells) -> list[Decimal | None]:
        clock = self.clock
        if isinstance(clock, DateTimes):
            return self._converted(cells, self.time, lambda cell: _date(clock, cell))
        return self._converted(cells, self.time, lambda cell: clock.seconds(_counted(cell)))

    def _numbers(self, cells: Cells, name: str, scale: float, offset: float = 0.0) -> Array:
        found = self._converted(cells, name, lambda cell: scaled(_counted(cell), scale, offset))
        return np.array([np.nan if number is None else number for number in found])

    def _converted(self, cells: Cells, name: str, convert: Callable[[object], _T]) -> list[_T | None]:
        found: list[_T | None] = []
        for row, cell in zip(cells.rows, cells.columns[name], strict=True):
            try:
                found.append(None if cell is None or cell != cell else convert(cell))  # noqa: PLR0124  NaN is not itself
            except ValueError as error:
                raise InputError(f"{self.path}, row {row}, column {name!r}: {error}") from error
        return found


def _size(metadata: Any, wanted: Sequence[str]) -> int:
    """Return the bytes that these columns have when they are unpacked: as stored, and 8 for each cell."""
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
    match cell:
        case _Instant(nanoseconds):
            return EXACT.multiply(Decimal(nanoseconds), NANOSECOND)
        case str():
            return clock.seconds(cell)
    raise ValueError(f"expected a date, got {cell!r}")


def _counted(cell: object) -> Decimal:
    if isinstance(cell, _Instant):
        raise ValueError('the column holds dates: "ISO 8601" is their time unit')
    number = exact(cell)
    if number is None:
        raise ValueError("expected a number, got none")
    return number
