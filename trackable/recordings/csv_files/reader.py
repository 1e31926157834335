"""Read recordings from CSV files."""

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
from trackable.recordings.from_rows import recording_from_rows
from trackable.recordings.origin import Origin, checked_origin
from trackable.recordings.recording import Recording
from trackable.recordings.repairs import Repair, chosen_repairs
from trackable.recordings.rows import Rows

_T = TypeVar("_T")


@dataclass(frozen=True)
class Column:
    """The column `name`; its numbers are multiplied by `scale` (1e-3 converts millimetres to metres).

    `noise_std` names the column with the standard deviation of each sample, in the file's unit of the values; it is
    scaled too. InputError: a scale that is zero or not finite.
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
    """Read signals from a CSV file with a header.

    Parameters
    ----------
    path
        The file.
    time
        The column of time stamps.
    time_unit
        The name of a clock in `CLOCKS` ("s", "ms", "epoch ns", "ISO 8601", …), or a clock: `frames(rate)`, `DateTimes`.
    signals
        By the name that a signal gets in the recording: a `Column`, or the name of a column.
    layout
        Separator, decimal mark, encoding, comments, lines to skip, texts that stand for a missing value.
    repairs
        Functions, or names of `REPAIRS`, applied in this order. What they do not mend is refused.
    origin
        The time zero [ns] on the file's clock, or "first" for the first sample of all signals. By default the file's
        own zero, or the first sample if stamps are dates or count from 1970.

    Cells without a value are left out and reported in `Recording.cleanings`.

    Raises
    ------
    InputError
        For a file that cannot be read, and for anything wrong in it that no repair mends: names file and line.

    """
    path = Path(path)
    if not signals:
        raise InputError(f"{path}: expected at least one signal, got none")
    clock, chosen, zero = clock_named(time_unit), chosen_repairs(repairs), checked_origin(origin)
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
    return recording_from_rows([rows], clock.absolute, chosen, zero)


def _column(signal: str, wanted: object) -> Column:
    if isinstance(wanted, Column):
        return wanted
    if isinstance(wanted, str):
        return Column(wanted)
    raise InputError(f"signal {signal!r}: expected a Column, or the name of one, got {wanted!r}")


@dataclass(frozen=True)
class _Cells:
    """The columns of a table, converted to numbers and stamps. InputError names line and column of a wrong cell."""

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
            return ""  # a value, but in another format
        others = ", ".join(map(repr, self.layout.missing)) or "nothing"
        return f"; if it stands for no value, name it in CsvLayout(missing=...) beside {others}"
