"""Recordings from CSV files."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import TypeVar

import numpy as np

from trackable.arrays import Array
from trackable.errors import InputError
from trackable.recordings.clocks import Clock, clock_named
from trackable.recordings.csv_files.table import PLAIN, CsvLayout, CsvTable, read_table
from trackable.recordings.dates import DateTimes
from trackable.recordings.decimals import check_scale, parse, scaled
from trackable.recordings.origin import Origin, checked_origin
from trackable.recordings.recording import Recording
from trackable.recordings.repairs import Repair, chosen_repairs
from trackable.recordings.rows import Rows
from trackable.recordings.settle import recorded

_T = TypeVar("_T")


@dataclass(frozen=True)
class Column:
    """The column `name`, its numbers times `scale` (1e-3 makes metres of millimetres).

    `noise_std` names the column with each sample's standard deviation, in the file's unit of the values. InputError
    where the scale is zero or not finite.
    """

    name: str
    scale: float = 1.0
    noise_std: str | None = None

    def __post_init__(self) -> None:
        check_scale(self.name, self.scale)


def read_csv(
    path: str | Path,
    time: str,
    time_unit: str | Clock,
    signals: Mapping[str, Column | str],
    layout: CsvLayout = PLAIN,
    repairs: Sequence[Repair | str] = (),
    origin: Origin = None,
) -> Recording:
    """Signals of a CSV file with a header, over its column `time`.

    `time_unit` is one of `CLOCKS`, by name, or a clock of one's own; a signal is a `Column`, or the name of one. Times
    [s] count from `origin` [ns], or from the first sample of all where that is "first"; without one from the zero of
    the file's own unit, and from the first sample where stamps are dates or since 1970.

    Rows are taken as they stand. Cells without a value are left out and reported; what else is wrong is mended where
    one of the `repairs`, functions or names of `REPAIRS`, does so, and otherwise refused. Raises InputError, naming
    file and line.
    """
    path = Path(path)
    if not signals:
        raise InputError(f"{path}: expected the name of a signal at least, got none")
    clock, mending, zero = clock_named(time_unit), chosen_repairs(repairs), checked_origin(origin)
    columns = {name: _column(name, wanted) for name, wanted in signals.items()}
    names = [time, *(name for c in columns.values() for name in (c.name, c.noise_std) if name is not None)]
    table = read_table(path, layout, names)
    cells = _Cells(path, table, layout)
    rows = Rows(
        str(path),
        [f"line {line}" for line in table.lines],
        cells.stamps(time, clock),
        {name: cells.numbers(column.name, column.scale) for name, column in columns.items()},
        {
            name: cells.numbers(column.noise_std, abs(column.scale))
            for name, column in columns.items()
            if column.noise_std is not None
        },
    )
    return recorded([rows], clock.absolute, mending, zero)


def _column(signal: str, wanted: object) -> Column:
    if isinstance(wanted, Column):
        return wanted
    if isinstance(wanted, str):
        return Column(wanted)
    raise InputError(f"signal {signal!r}: expected a Column, or the name of one, got {wanted!r}")


@dataclass(frozen=True)
class _Cells:
    """The columns of a table as numbers and stamps; InputError names line and column of a cell that is neither."""

    path: Path
    table: CsvTable
    layout: CsvLayout

    def numbers(self, name: str, scale: float) -> Array:
        mark = self.layout.decimal
        found = self._converted(name, lambda cell: scaled(parse(cell, mark), scale))
        return np.array([np.nan if number is None else number for number in found])

    def stamps(self, name: str, clock: Clock) -> list[Decimal | None]:
        if isinstance(clock, DateTimes):
            return self._converted(name, clock.seconds)
        return self._converted(name, lambda cell: clock.seconds(parse(cell, self.layout.decimal)))

    def _converted(self, name: str, convert: Callable[[str], _T]) -> list[_T | None]:
        column = self.table.header.index(name)
        is_missing = self.layout.is_missing
        found: list[_T | None] = []
        for line, row in zip(self.table.lines, self.table.rows, strict=True):
            cell = row[column]
            try:
                found.append(None if is_missing(cell) else convert(cell))
            except ValueError as error:
                raise InputError(f"{self.path}, line {line}, column {name!r}: {error}{self._hint(cell)}") from error
        return found

    def _hint(self, cell: str) -> str:
        if cell.strip().lstrip("+-.,")[:1].isdigit():
            return ""  # there is a value, written in another way
        others = ", ".join(map(repr, self.layout.missing)) or "nothing"
        return f"; if it stands for no value, name it in CsvLayout(missing=...) beside {others}"
