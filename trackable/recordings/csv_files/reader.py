"""Read recordings from CSV files."""

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import TypeVar

import numpy as np

from trackable.arrays import Array
from trackable.errors import DoubtfulInputWarning, InputError
from trackable.recordings.chosen import check_mapping, path_given
from trackable.recordings.clocks import Clock, clock_named, first_doubt
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
    scaled too. InputError: a scale that is zero or not finite, or names that are none.
    """

    name: str
    scale: float = 1.0
    noise_std: str | None = None

    def __post_init__(self) -> None:
        for what, name in (("name", self.name), ("noise_std", self.noise_std)):
            if not isinstance(name, str) and not (what == "noise_std" and name is None):
                raise InputError(f"Column: {what}: expected the name of a column, got {name!r}")
        check_scale(self.name, self.scale)


def read_csv(
    path: str | Path,
    time: str | None,
    time_unit: str | Clock,
    signals: Mapping[str, Column | str],
    layout: CsvLayout = PLAIN,
    repairs: Sequence[Repair | str] = (),
    origin: Origin = None,
) -> Recording:
    """Read signals from a CSV file, packed with gzip or not, with a header or with names in the layout.

    Parameters
    ----------
    path
        The file.
    time
        The column of time stamps. None for a file without one: its rows are counted from 0, as `frames(rate)` expects.
    time_unit
        The name of a clock in `CLOCKS` ("s", "ms", "epoch ns", "ISO 8601", …), or a clock: `frames(rate)`, `DateTimes`.
    signals
        By the name that a signal gets in the recording: a `Column`, or the name of a column.
    layout
        Separator, decimal mark, encoding, comments, lines to skip, texts that stand for a missing value, and the names
        of columns where there is no header. `TUM` and `KITTI` are layouts.
    repairs
        Functions, or names of `REPAIRS`, applied in this order. What they do not mend is refused.
    origin
        The time zero [ns] on the file's clock, or "first" for the first sample of all signals. By default the file's
        own zero, or the first sample if stamps are dates or count from 1970.

    Cells without a value are left out and reported in `Recording.cleanings`.

    Warns
    -----
    DoubtfulInputWarning
        For stamps that are hardly in the unit that is said: as seconds since 1970 where they are milliseconds.

    Raises
    ------
    InputError
        For a file that cannot be read, and for anything wrong in it that no repair mends: names file and line.

    """
    path = path_given(path)
    check_mapping(path, signals, 'a mapping from names to columns, as {"position": "x"}')
    if not isinstance(layout, CsvLayout):
        raise InputError(f"layout: expected a CsvLayout, as CsvLayout(separator=';'), got {layout!r}")
    if not isinstance(time, str | None):
        raise InputError(f"time: expected the name of a column, or None to count rows, got {time!r}")
    clock, chosen, zero = clock_named(time_unit), chosen_repairs(repairs), checked_origin(origin)
    columns = {name: _column(name, wanted) for name, wanted in signals.items()}
    names = [name for name in (time, *(n for c in columns.values() for n in (c.name, c.noise_std))) if name is not None]
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
    if zero is None and (question := first_doubt(clock, rows.stamps)):
        warnings.warn(f"{path}: {question}", DoubtfulInputWarning, stacklevel=2)
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

    def stamps(self, name: str | None, clock: Clock) -> list[Decimal | None]:
        if name is None:
            return self._counted(clock)
        if isinstance(clock, DateTimes):
            return self._converted(name, clock.seconds)
        return self._converted(name, lambda cell: clock.seconds(parse(cell, self.layout.decimal)))

    def _counted(self, clock: Clock) -> list[Decimal | None]:
        if isinstance(clock, DateTimes):
            raise InputError(f"{self.path}: time=None counts rows, and no count is a date: give frames(rate) as unit")
        return [clock.seconds(Decimal(row)) for row in range(len(self.table.rows))]

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
