"""Tables of named columns from any kind of file: convert cells to numbers and times, or raise
an error that names a cell.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from reprlib import repr as short
from typing import Any, NamedTuple, Self, TypeVar

import numpy as np

from trackably.arguments import is_number
from trackably.arrays import Array
from trackably.errors import DoubtfulInputWarning, InputError
from trackably.recordings.clocks import (
    EXACT,
    Clock,
    DateTimes,
    Origin,
    check_scale,
    checked_origin,
    clock_named,
    doubt,
    origin_seconds,
    scale_once,
    shorten,
    zero_of,
)
from trackably.recordings.recording import Recording
from trackably.recordings.rows import Repair, Rows, chosen_repairs, recording_from_rows, rows_between

# Arguments that all readers share, and files that they refuse because of their first bytes.


def path_given(given: object) -> Path:
    """Return the path of a file, given as a path or a text. InputError: it is neither."""
    if not isinstance(given, str | Path):
        raise InputError(f"path: expected the path of a file, got {short(given)}")
    return Path(given)


def check_mapping(source: str, signals: object, described: str) -> None:
    """Raise InputError if `signals` is no mapping from names, or empty."""
    if not isinstance(signals, Mapping):
        raise InputError(f"signals: expected {described}, got {short(signals)}")
    if not signals:
        raise InputError(f"{source}: expected at least one signal, got none")
    for name in signals:
        if not isinstance(name, str):
            raise InputError(f"signals: expected names as texts, got {short(name)}")


def checked_window(between: object) -> tuple[float, float] | None:
    """Return (start, end) [s], or None for all times. InputError: anything else."""
    match between:
        case None:
            return None
        case (start, end) if is_number(start) and is_number(end) and start < end:
            return float(start), float(end)
    raise InputError(f"between: expected (start, end) in seconds with start < end, or None, got {between!r}")


GZIP = b"\x1f\x8b"
MCAP = b"\x89MCAP"

LARGEST = 400_000_000
"""Largest unpacked size of a file, or of the data kept from it, in bytes: few kilobytes can unpack to gigabytes."""

_SAVE = "save it as CSV"
_CONVERT = "`mcap convert` of the MCAP project makes an MCAP file of it"
_KINDS = (
    (b"PK\x03\x04", "a zip archive, as spreadsheets are (.xlsx, .ods)", f"{_SAVE}, or unpack it"),
    (b"\xd0\xcf\x11\xe0", "an old spreadsheet (.xls)", _SAVE),
    (b"#ROSBAG", "a ROS 1 bag", _CONVERT),
    (b"SQLite format 3\0", "a database, as ROS 2 bags are (.db3)", _CONVERT),
    (b"PAR1", "a Parquet file", _SAVE),
    (b"\x89HDF", "an HDF5 file, as MATLAB's newer ones are (.mat)", _SAVE),
    (b"MATLAB ", "a MATLAB file (.mat)", _SAVE),
    (b"\x93NUMPY", "a NumPy file (.npy)", "load it, and give its arrays to Samples(times, values)"),
)


def refuse_other_kinds(path: Path, data: bytes) -> None:
    """Raise InputError for a file of a kind that no reader reads, recognised by its first bytes."""
    for start, kind, help_ in _KINDS:
        if data.startswith(start):
            raise InputError(f"{path}: this is {kind}: {help_}")


def refuse_no_mcap(path: Path, data: bytes) -> None:
    """Raise InputError for a file that is no MCAP file, with the kind of file that it is."""
    if not data or data.startswith(MCAP):
        return
    refuse_other_kinds(path, data)
    if data.startswith(GZIP):
        raise InputError(f"{path}: this is a gzip file: unpack it")
    if data.isascii() and b"\0" not in data:
        raise InputError(f"{path}: this is a text file, not MCAP: read_csv reads tables")


_T = TypeVar("_T")


@dataclass(frozen=True)
class Column:
    """The column `name`; its numbers are multiplied by `scale` (1e-3 converts millimetres to metres).

    Then `offset` is added, in the new unit: 273.15 converts degrees Celsius to kelvins, and -0.012 removes a sensor's
    value at zero. `noise_std` names the column with the standard deviation of each sample, in the file's unit of the
    values; it is scaled too. InputError: scale or offset is not finite, the scale is zero, or a name is no text.
    """

    name: str
    scale: float = 1.0
    noise_std: str | None = None
    offset: float = 0.0

    def __post_init__(self) -> None:
        for what, name in (("name", self.name), ("noise_std", self.noise_std)):
            if not isinstance(name, str) and not (what == "noise_std" and name is None):
                raise InputError(f"Column: {what}: expected the name of a column, got {name!r}")
        check_scale(self.name, self.scale, self.offset)


@dataclass(frozen=True)
class Cells:
    """Columns of a table by name, as they are in the file; `places` names each row, "line 12" or "row 3"."""

    columns: Mapping[str, Sequence[Any]]
    places: Sequence[str]

    def part(self, chosen: Sequence[int]) -> Cells:
        """Return these rows, given as positions from 0, in this order."""
        columns = {name: [column[i] for i in chosen] for name, column in self.columns.items()}
        return Cells(columns, [self.places[i] for i in chosen])


class Form(NamedTuple):
    """How a kind of file writes values in its cells, which it calls columns or fields (`what`).

    ValueError: a cell has another content.
    """

    what: str
    is_missing: Callable[[Any], bool]
    number: Callable[[Any], Decimal]
    date: Callable[[DateTimes, Any], Decimal]
    hint: Callable[[Any], str]
    """Returns advice for a refused cell."""


def date_in_text(clock: DateTimes, cell: object) -> Decimal:
    """Return the time [s] of a decoded date. ValueError: it is no text, or no date."""
    if not isinstance(cell, str):
        raise ValueError(f"expected a date and a time of day as text, got {shorten(cell)}")
    return clock.seconds(cell)


def is_none(value: object) -> bool:
    """Whether a decoded value is null or NaN, which both mean that there is none."""
    return value is None or value != value  # noqa: PLR0124


@dataclass(frozen=True)
class TableReading:
    """The columns of a file, or of a topic, with their names in the recording; its clock, its form, and the repairs."""

    source: str
    form: Form
    time: str | None
    clock: Clock
    columns: Mapping[str, Column]
    repairs: tuple[Repair, ...]
    origin: Origin
    between: tuple[float, float] | None

    @classmethod
    def of(
        cls,
        source: str,
        form: Form,
        time: str | None,
        time_unit: str | Clock,
        signals: Mapping[str, Column | str],
        repairs: Sequence[Repair | str],
        origin: Origin,
        between: tuple[float, float] | None = None,
    ) -> Self:
        """Check and return the arguments of a reader. InputError: one of them is wrong."""
        check_mapping(source, signals, 'a mapping from names to columns, as {"position": "x"}')
        columns = {}
        for name, wanted in signals.items():
            if not isinstance(wanted, Column | str):
                raise InputError(f"signal {name!r}: expected a Column, or the name of one, got {wanted!r}")
            columns[name] = Column(wanted) if isinstance(wanted, str) else wanted
        clock, chosen, zero = clock_named(time_unit), tuple(chosen_repairs(repairs)), checked_origin(origin)
        return cls(source, form, time, clock, columns, chosen, zero, checked_window(between))

    @property
    def names(self) -> list[str]:
        """The columns that the file has to have, without duplicates."""
        names = (self.time, *(name for column in self.columns.values() for name in (column.name, column.noise_std)))
        return list(dict.fromkeys(name for name in names if name is not None))

    def rows(self, cells: Cells, stamps: Sequence[Decimal | None]) -> Rows:
        """Return the values of a table with these stamps [s]. InputError: a cell has another content."""
        values = {name: self._numbers(cells, of.name, of.scale, of.offset) for name, of in self.columns.items()}
        noise_std = {
            name: self._numbers(cells, of.noise_std, abs(of.scale))
            for name, of in self.columns.items()
            if of.noise_std is not None
        }
        return Rows(self.source, cells.places, stamps, values, noise_std)

    def stamps(self, cells: Cells) -> list[Decimal | None]:
        """Return the time [s] of each row, exactly; None if it has none."""
        clock, form = self.clock, self.form
        if isinstance(clock, DateTimes):
            if self.time is None:
                raise InputError(
                    f"{self.source}: time=None counts rows, and no count is a date: give frames(rate) as unit"
                )
            return self._convert(cells, self.time, lambda cell: form.date(clock, cell))
        if self.time is None:
            return [clock.seconds(Decimal(row)) for row in range(len(cells.places))]
        return self._convert(cells, self.time, lambda cell: clock.seconds(form.number(cell)))

    def stamps_with_values(self, cells: Cells, stamps: Sequence[Decimal | None]) -> Iterator[Decimal]:
        """Yield the stamps [s] of the rows that have a value in one of the columns."""
        rows = zip(*(cells.columns[column.name] for column in self.columns.values()), strict=True)
        for t, row in zip(stamps, rows, strict=True):
            if t is not None and not all(map(self.form.is_missing, row)):
                yield t

    def _numbers(self, cells: Cells, name: str, scale: float, offset: float = 0.0) -> Array:
        found = self._convert(cells, name, lambda cell: scale_once(self.form.number(cell), scale, offset))
        return np.array([np.nan if number is None else number for number in found])

    def _convert(self, cells: Cells, name: str, convert: Callable[[Any], _T]) -> list[_T | None]:
        found: list[_T | None] = []
        for place, cell in zip(cells.places, cells.columns[name], strict=True):
            try:
                found.append(None if self.form.is_missing(cell) else convert(cell))
            except ValueError as error:
                hint = self.form.hint(cell)
                raise InputError(f"{self.source}, {place}, {self.form.what} {name!r}: {error}{hint}") from error
        return found


def recording_of(*tables: tuple[TableReading, Cells]) -> Recording:
    """Return the recording of tables, whose clocks have one zero, and whose repairs, origin and window are the same.

    Raises InputError; warns the caller's caller of implausible stamps, and of repairs that may be wrong.
    """
    reading, _ = tables[0]
    origin, absolute = reading.origin, reading.clock.absolute
    stamped = [(of, cells, of.stamps(cells)) for of, cells in tables]
    if origin is None:
        for of, _, stamps in stamped:
            first = next((stamp for stamp in stamps if stamp is not None), None)
            if first is not None and (question := doubt(of.clock, first)):
                warnings.warn(f"{of.source}: {question}", DoubtfulInputWarning, stacklevel=3)
    if reading.between:
        seen = [t for of, cells, stamps in stamped for t in of.stamps_with_values(cells, stamps)]
        origin = zero_of(origin, absolute, min(seen, default=Decimal(0)))
        inside = [rows_between(stamps, reading.between, origin) for _, _, stamps in stamped]
        if not any(inside):
            raise InputError(f"{reading.source}: between: {_outside(seen, reading.between, origin)}")
        stamped = [
            (of, cells.part(rows), [stamps[i] for i in rows])
            for rows, (of, cells, stamps) in zip(inside, stamped, strict=True)
        ]
    rows = [of.rows(cells, stamps) for of, cells, stamps in stamped]
    found = recording_from_rows(rows, absolute, reading.repairs, origin)
    for question in (question for cleaning in found.cleanings for question in cleaning.questions):
        warnings.warn(question, DoubtfulInputWarning, stacklevel=3)
    return found


def _outside(seen: Sequence[Decimal], between: tuple[float, float], origin: int) -> str:
    """Say that no sample lies in a window [s], and from when to when samples were `seen`."""
    none = f"there is no sample from {between[0]:g} s to {between[1]:g} s"
    if not seen:
        return none
    zero = origin_seconds(origin)
    first, last = (float(EXACT.subtract(t, zero)) for t in (min(seen), max(seen)))
    return f"{none}; they are from {first:g} s to {last:g} s"
