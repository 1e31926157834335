"""Tables of named columns from any kind of file: convert cells to numbers and times; each error names a cell."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from types import UnionType
from typing import Any, TypeVar

import numpy as np

from trackably.arguments import instance, names, real, text, whole
from trackably.arrays import Array
from trackably.errors import DoubtfulInputWarning, InputError
from trackably.recordings.clocks import Clock, DateTimes, Origin, clock_named, exact, scale_once, zero_of
from trackably.recordings.recording import Cleaning, Recording
from trackably.recordings.rows import (
    Repair,
    Rows,
    chosen_repairs,
    describe_restart,
    drop_rows_out_of_order,
    drop_rows_without_time,
    first_stamp,
    repair,
    samples_since,
    sort_rows,
)

# Kinds of files, by their first bytes, that a reader refuses: those of other readers, and those that none reads.

MCAP = b"\x89MCAP"

LARGEST = 400_000_000
"""Largest unpacked size of a file, or of the data kept from it, in bytes: few kilobytes can unpack to gigabytes."""

_SAVE = "save it as CSV"
_CONVERT = "`mcap convert` of the MCAP project makes an MCAP file of it"
_KINDS = (
    (MCAP, "an MCAP file", "read_mcap reads it"),
    (b"\x1f\x8b", "a gzip file", "unpack it"),
    (b"PK\x03\x04", "a zip archive, as spreadsheets are (.xlsx, .ods)", f"{_SAVE}, or unpack it"),
    (b"\xd0\xcf\x11\xe0", "an old spreadsheet (.xls)", _SAVE),
    (b"#ROSBAG", "a ROS 1 bag", _CONVERT),
    (b"SQLite format 3\0", "a database, as ROS 2 bags are (.db3)", _CONVERT),
    (b"PAR1", "a Parquet file", "read_parquet reads it"),
    (b"\x89HDF", "an HDF5 file, as MATLAB's newer ones are (.mat)", _SAVE),
    (b"MATLAB ", "a MATLAB file (.mat)", _SAVE),
    (b"\x93NUMPY", "a NumPy file (.npy)", "load it, and give its arrays to Samples(times, values)"),
)


def refuse_other_kinds(path: Path, data: bytes) -> None:
    """Raise InputError if the first bytes show a kind of file that another reader reads, or that no reader reads."""
    for start, kind, help_ in _KINDS:
        if data.startswith(start):
            raise InputError(f"{path}: this is {kind}: {help_}")


def refuse_no_mcap(path: Path, data: bytes) -> None:
    """Raise InputError if a file is no MCAP file; the message says what it is."""
    if not data or data.startswith(MCAP):
        return
    refuse_other_kinds(path, data)
    if b"\0" not in data:
        raise InputError(f"{path}: this is a text file, not MCAP: read_csv reads tables")


@dataclass(frozen=True)
class Column:
    """The column `name`; its numbers are multiplied by `scale` (1e-3 converts millimetres to metres).

    Then `offset` is added, in the new unit: 273.15 converts degrees Celsius to kelvins, and -0.012 removes a sensor's
    value at zero. TypeError: the name is no text, or scale or offset no number. ValueError: one of these is not finite,
    or the scale is zero.
    """

    name: str
    scale: float = 1.0
    offset: float = 0.0

    def __post_init__(self) -> None:
        text("Column: name", self.name)
        real(f"{self.name!r}: offset", self.offset)
        if not real(f"{self.name!r}: scale", self.scale):
            raise ValueError(f"{self.name!r}: expected a scale other than zero, got {self.scale}")


def is_none(value: object) -> bool:
    """Whether a decoded value is null or NaN, which both mean that there is none."""
    return value is None or value != value  # noqa: PLR0124


_T = TypeVar("_T")


@dataclass(frozen=True)
class Table:
    """Columns of the `source`, a file or a topic: cells by column as they are written, None for no value.

    `places` names each row, "line 12" or "row 3". `mark` is the decimal mark of numbers written as text; without one,
    texts are no numbers. Messages call a column `what`, and end with `advice` if a cell does not begin as a number.
    """

    source: str
    places: Sequence[str]
    columns: Mapping[str, Sequence[Any]]
    mark: str | None = None
    what: str = "column"
    advice: str = ""

    def numbers(self, name: str, scale: float = 1.0, offset: float = 0.0) -> Array:
        """Return the numbers of a column, scaled, NaN for no value. InputError: a cell is no number."""
        found = self.convert(name, lambda cell: scale_once(exact(cell, self.mark), scale, offset))
        return np.array([np.nan if number is None else number for number in found])

    def convert(self, name: str, convert: Callable[[Any], _T]) -> list[_T | None]:
        """Return the converted cells of a column, None for no value. InputError: `convert` raised a ValueError."""
        found: list[_T | None] = []
        for place, cell in zip(self.places, self.columns[name], strict=True):
            try:
                found.append(None if cell is None else convert(cell))
            except ValueError as error:
                advice = "" if str(cell).strip().lstrip("+-.,")[:1].isdigit() else self.advice
                raise InputError(f"{self.source}, {place}, {self.what} {name!r}: {error}{advice}") from error
        return found


@dataclass(frozen=True)
class Reading:
    """The arguments of a reader: which columns of a table it reads as times and as signals.

    `time` is the column of time stamps, or several columns whose texts make one stamp, joined by spaces; None counts
    rows. TypeError, ValueError: an argument is wrong.
    """

    time: str | Sequence[str] | None
    unit: str | Clock
    signals: Mapping[str, Column | str]
    repairs: Sequence[Repair | str]
    origin: Origin

    def __post_init__(self) -> None:
        check_signals(self.signals, Column | str, 'a Column or the name of one, as {"position": "x"}')
        if self.time is not None and not isinstance(self.time, str):
            described = 'the name of a column, names of several as ("Date", "Time"), or None to count rows'
            instance("time", self.time, tuple | list, described)
            if not names("time", self.time):
                raise ValueError(f"time: expected {described}, got {self.time!r}")
        if isinstance(self.clock, DateTimes) and self.time is None:
            raise ValueError(
                "time: None counts rows, and a row number is no date; give frames(rate) as unit, or a column with dates"
            )
        chosen_repairs(self.repairs)
        if self.origin not in (None, "first"):
            origin = whole('origin in nanoseconds (or None, or "first")', self.origin)
            object.__setattr__(self, "origin", origin)

    @cached_property
    def clock(self) -> Clock:
        """The clock that converts time stamps to seconds."""
        return clock_named(self.unit)

    @cached_property
    def columns(self) -> dict[str, Column]:
        """The columns by the names of signals."""
        return {name: Column(of) if isinstance(of, str) else of for name, of in self.signals.items()}

    @property
    def times(self) -> tuple[str, ...]:
        """The columns with the time stamps; none if rows are counted."""
        return (self.time,) if isinstance(self.time, str) else tuple(self.time or ())

    @property
    def names(self) -> list[str]:
        """The columns that the file has to have, without duplicates."""
        return list(dict.fromkeys((*self.times, *(column.name for column in self.columns.values()))))

    def _stamps(self, table: Table) -> Sequence[Any]:
        """Return the stamps as they are written: cells of one column, joined texts of several, or row numbers."""
        if not self.times:
            return range(len(table.places))
        first, *others = (table.columns[name] for name in self.times)
        rows = zip(first, *others, strict=True)
        joined = (None if None in row else " ".join(str(cell).strip() for cell in row) for row in rows)
        return list(joined) if others else first

    def rows(self, table: Table) -> Rows:
        """Return the times and values of a table. InputError: a cell is no time stamp or no number."""
        name, written, clock = ", ".join(self.times) or "row number", self._stamps(table), self.clock
        stamps = replace(table, columns={name: written}).convert(name, lambda cell: clock.seconds(cell, table.mark))
        values = {signal: table.numbers(of.name, of.scale, of.offset) for signal, of in self.columns.items()}
        found = Rows(table.source, table.places, stamps, values)
        if not isinstance(clock, DateTimes):
            return found
        as_utc = [row for row, date in enumerate(written) if date and clock.is_taken_as_utc(date)]
        return replace(found, dates=written).reported(as_utc, "no time zone, taken as UTC")


def check_signals(signals: Mapping[str, Any], wanted: type | UnionType, described: str) -> None:
    """Raise TypeError if `signals` does not map names to objects of a type, ValueError if it is empty."""
    instance("signals", signals, Mapping, f"by name {described}")
    if not signals:
        raise ValueError("signals: expected at least one, got none")
    for name, of in signals.items():
        instance(f"signal {text('signals: name', name)!r}", of, wanted, described)


_YEAR, _YEAR_2100 = 31556952, 4102444800  # [s], the latter since 1970


def recording_of(*tables: tuple[Reading, Table]) -> Recording:
    """Return the recording of tables whose clocks count from one zero, with the same repairs and origin.

    Raises InputError. At the line that called the reader, warns if the clock seems to start again, and rows are sorted
    or dropped because of that, and of stamps after the year 2100.
    """
    reading, _ = tables[0]
    rows, repairs = [of.rows(table) for of, table in tables], chosen_repairs(reading.repairs)
    if {sort_rows, drop_rows_out_of_order} & {*repairs}:
        for timed in map(drop_rows_without_time, rows):
            if question := describe_restart(timed):
                # shown at the line that calls the reader
                warnings.warn(f"{timed.source}: {question}", DoubtfulInputWarning, stacklevel=3)
    repaired, absolute = [repair(read, repairs) for read in rows], reading.clock.absolute
    first = min(map(first_stamp, repaired))
    if absolute and first > _YEAR_2100:
        year = 1970 + int(first / _YEAR)
        warnings.warn(
            f"{rows[0].source}: times begin in the year {year}: is their unit right?",
            DoubtfulInputWarning,
            stacklevel=3,
        )
    zero = zero_of(reading.origin, absolute, first)
    signals = {name: samples_since(zero, of, name) for of in repaired for name in of.values}
    cleanings = (Cleaning(of.source, len(read), of.findings) for read, of in zip(rows, repaired, strict=True))
    return Recording(signals, zero, tuple(cleanings), absolute)
