"""Tables of named columns from any kind of file: convert cells to numbers and times; each error names a cell."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from functools import cached_property
from pathlib import Path
from types import UnionType
from typing import Any, TypeVar

import numpy as np

from trackably.arguments import instance, is_number, names, real, text, whole
from trackably.arrays import Array
from trackably.errors import DoubtfulInputWarning, InputError
from trackably.recordings.clocks import (
    EXACT,
    Clock,
    DateTimes,
    Origin,
    clock_named,
    doubt,
    exact,
    origin_seconds,
    scale_once,
    zero_of,
)
from trackably.recordings.recording import Recording
from trackably.recordings.rows import Repair, Rows, chosen_repairs, recording_from_rows

# Kinds of files, by their first bytes, that a reader refuses because another one reads them, or none.

GZIP = b"\x1f\x8b"
MCAP = b"\x89MCAP"

LARGEST = 400_000_000
"""Largest unpacked size of a file, or of the data kept from it, in bytes: few kilobytes can unpack to gigabytes."""

_SAVE = "save it as CSV"
_CONVERT = "`mcap convert` of the MCAP project makes an MCAP file of it"
_KINDS = (
    (MCAP, "an MCAP file", "read_mcap reads it"),
    (GZIP, "a gzip file", "unpack it"),
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
    value at zero. `noise_std` names the column with the standard deviation of each sample, in the file's unit of the
    values; it is scaled too. TypeError: a name is no text, or scale or offset no number. ValueError: one of these is
    not finite, or the scale is zero.
    """

    name: str
    scale: float = 1.0
    noise_std: str | None = None
    offset: float = 0.0

    def __post_init__(self) -> None:
        text("Column: name", self.name)
        if self.noise_std is not None:
            text(f"{self.name!r}: noise_std", self.noise_std)
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

    `places` names each row, "line 12" or "row 3", and `stamps` are their times [s] once these are known, None for no
    time. `mark` is the decimal mark of numbers written as text; without one, texts are no numbers. Messages call a
    column `what`, and end with `advice` if a cell does not begin as a number.
    """

    source: str
    places: Sequence[str]
    columns: Mapping[str, Sequence[Any]]
    mark: str | None = None
    what: str = "column"
    advice: str = ""
    stamps: Sequence[Decimal | None] = ()

    def part(self, chosen: Sequence[int]) -> Table:
        """Return these rows, given as positions from 0, in this order."""
        columns = {name: [column[i] for i in chosen] for name, column in self.columns.items()}
        stamps = [self.stamps[i] for i in chosen] if self.stamps else ()
        return replace(self, places=[self.places[i] for i in chosen], columns=columns, stamps=stamps)

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
    """The arguments of a reader: which columns of a table it reads as signals, and over which times.

    `time` is the column of time stamps, or several columns whose texts make one stamp, joined by spaces; None counts
    rows. TypeError, ValueError: an argument is wrong.
    """

    time: str | Sequence[str] | None
    unit: str | Clock
    signals: Mapping[str, Column | str]
    repairs: Sequence[Repair | str]
    origin: Origin
    between: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        check_signals(self.signals, Column | str, 'a Column or the name of one, as {"position": "x"}')
        if self.time is not None and not isinstance(self.time, str):
            described = 'the name of a column, names of several as ("Date", "Time"), or None to count rows'
            instance("time", self.time, tuple | list, described)
            if not names("time", self.time):
                raise ValueError(f"time: expected {described}, got {self.time!r}")
        if isinstance(self.clock, DateTimes) and self.time is None:
            raise ValueError("time: with None, the time is the row number, which is no date; give frames(rate) as unit")
        chosen_repairs(self.repairs)
        if self.origin not in (None, "first"):
            origin = whole('origin in nanoseconds (or None, or "first")', self.origin)
            object.__setattr__(self, "origin", origin)
        match self.between:
            case (start, end) if is_number(start) and is_number(end) and start < end:
                pass
            case given if given is not None:
                raise ValueError(f"between: expected (start, end) in seconds, start < end, or None, got {given!r}")

    @cached_property
    def clock(self) -> Clock:
        """The clock of the times."""
        return clock_named(self.unit)

    @cached_property
    def columns(self) -> dict[str, Column]:
        """The columns by the names of signals."""
        return {name: Column(of) if isinstance(of, str) else of for name, of in self.signals.items()}

    @property
    def names(self) -> list[str]:
        """The columns that the file has to have, without duplicates."""
        times = (self.time,) if isinstance(self.time, str) else self.time or ()
        named = (*times, *(name for column in self.columns.values() for name in (column.name, column.noise_std)))
        return list(dict.fromkeys(name for name in named if name is not None))

    def stamped(self, table: Table) -> Table:
        """Return the table with its times. InputError: a cell is no time stamp of the clock."""
        if self.time is None:
            return replace(table, stamps=[self.clock.seconds(row) for row in range(len(table.places))])
        name, stamped = self.time, table
        if not isinstance(name, str):
            parts, name = name, ", ".join(name)
            rows = zip(*(table.columns[part] for part in parts), strict=True)
            joined = [None if None in row else " ".join(str(cell).strip() for cell in row) for row in rows]
            stamped = replace(table, columns={name: joined})
        return replace(table, stamps=stamped.convert(name, lambda cell: self.clock.seconds(cell, table.mark)))

    def stamps_with_values(self, table: Table) -> list[Decimal]:
        """Return the stamps [s] of the rows that have a value in one of the columns."""
        rows = zip(*(table.columns[column.name] for column in self.columns.values()), strict=True)
        return [
            t
            for t, row in zip(table.stamps, rows, strict=True)
            if t is not None and any(value is not None for value in row)
        ]

    def rows(self, table: Table) -> Rows:
        """Return the values of a table with its times. InputError: a cell is no number."""
        columns = self.columns.items()
        values = {name: table.numbers(of.name, of.scale, of.offset) for name, of in columns}
        noise_std = {
            name: table.numbers(of.noise_std, abs(of.scale)) for name, of in columns if of.noise_std is not None
        }
        return Rows(table.source, table.places, table.stamps, values, noise_std)


def check_signals(signals: Mapping[str, Any], wanted: type | UnionType, described: str) -> None:
    """Raise TypeError if `signals` does not map names to objects of a type, ValueError if it is empty."""
    instance("signals", signals, Mapping, f"by name {described}")
    if not signals:
        raise ValueError("signals: expected at least one, got none")
    for name, of in signals.items():
        instance(f"signal {text('signals: name', name)!r}", of, wanted, described)


def recording_of(*tables: tuple[Reading, Table]) -> Recording:
    """Return the recording of tables whose clocks count from one zero, with the same repairs, origin and window.

    Raises InputError; warns the caller's caller of implausible stamps, and of repairs that may be wrong.
    """
    reading, _ = tables[0]
    origin, absolute = reading.origin, reading.clock.absolute
    tables = tuple((of, of.stamped(table)) for of, table in tables)
    if origin is None:
        _warn(_doubts(tables))
    if reading.between:
        seen = [t for of, table in tables for t in of.stamps_with_values(table)]
        origin = zero_of(origin, absolute, min(seen, default=Decimal(0)))
        tables = _inside(tables, seen, reading.between, origin_seconds(origin))
    rows = [of.rows(table) for of, table in tables]
    found = recording_from_rows(rows, absolute, chosen_repairs(reading.repairs), origin)
    _warn(question for cleaning in found.cleanings for question in cleaning.questions)
    return found


def _inside(
    tables: Sequence[tuple[Reading, Table]], seen: Sequence[Decimal], between: tuple[float, float], zero: Decimal
) -> tuple[tuple[Reading, Table], ...]:
    """Return the rows with start ≤ time ≤ end [s] since `zero`, or without a time.

    InputError, with the times at which values were `seen`: there is no such row.
    """
    start, end = (EXACT.add(zero, Decimal(repr(float(given)))) for given in between)
    chosen = [[row for row, t in enumerate(table.stamps) if t is None or start <= t <= end] for _, table in tables]
    if seen and not any(chosen):
        first, last = (float(EXACT.subtract(t, zero)) for t in (min(seen), max(seen)))
        raise InputError(
            f"{tables[0][1].source}: between: there is no sample from {between[0]:g} s to {between[1]:g} s; samples "
            f"are from {first:g} s to {last:g} s"
        )
    return tuple((of, table.part(rows)) for rows, (of, table) in zip(chosen, tables, strict=True))


def _doubts(tables: Sequence[tuple[Reading, Table]]) -> Iterator[str]:
    """Yield a question for each table whose first stamp is implausible."""
    for reading, table in tables:
        first = next((stamp for stamp in table.stamps if stamp is not None), None)
        if first is not None and (question := doubt(reading.clock, first)):
            yield f"{table.source}: {question}"


def _warn(questions: Iterable[str]) -> None:
    for question in questions:
        warnings.warn(question, DoubtfulInputWarning, stacklevel=4)  # shown at the line that calls the reader
