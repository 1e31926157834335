"""What is read from the cells of CSV files, and how: checked once, and applied to whole tables or to parts of them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import Self, TypeVar

import numpy as np

from trackably.arrays import Array
from trackably.errors import InputError
from trackably.recordings.chosen import check_mapping
from trackably.recordings.clocks import Clock, clock_named
from trackably.recordings.csv_files.table import CsvLayout, CsvTable, read_table
from trackably.recordings.dates import DateTimes
from trackably.recordings.decimals import check_scale, parse, scaled
from trackably.recordings.from_rows import recording_of_table
from trackably.recordings.origin import Origin, checked_origin, zero_of
from trackably.recordings.recording import Recording
from trackably.recordings.repairs import Repair, chosen_repairs
from trackably.recordings.rows import Rows, rows_between

_T = TypeVar("_T")


@dataclass(frozen=True)
class Column:
    """The column `name`; its numbers are multiplied by `scale` (1e-3 converts millimetres to metres).

    Then `offset` is added, in the new unit: 273.15 makes kelvins of degrees Celsius, and -0.012 takes away what a
    sensor shows at zero. `noise_std` names the column with the standard deviation of each sample, in the file's unit of
    the values; it is scaled too. InputError: a scale or an offset that is not finite, a scale of zero, or names that
    are none.
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
class CsvReading:
    """The columns of a file with their names in the recording, its clock and layout, and what mends its rows."""

    path: Path
    time: str | None
    clock: Clock
    columns: Mapping[str, Column]
    layout: CsvLayout
    repairs: tuple[Repair, ...]
    origin: Origin
    between: tuple[float, float] | None = None

    @classmethod
    def of(
        cls,
        path: Path,
        time: str | None,
        time_unit: str | Clock,
        signals: Mapping[str, Column | str],
        layout: CsvLayout,
        repairs: Sequence[Repair | str],
        origin: Origin,
    ) -> Self:
        """Return the arguments of `read_csv`, checked. InputError: one of them is wrong."""
        check_mapping(path, signals, 'a mapping from names to columns, as {"position": "x"}')
        if not isinstance(layout, CsvLayout):
            raise InputError(f"layout: expected a CsvLayout, as CsvLayout(separator=';'), got {layout!r}")
        if not isinstance(time, str | None):
            raise InputError(f"time: expected the name of a column, or None to count rows, got {time!r}")
        columns = {name: column_given(name, wanted) for name, wanted in signals.items()}
        clock, chosen, zero = clock_named(time_unit), chosen_repairs(repairs), checked_origin(origin)
        return cls(path, time, clock, columns, layout, tuple(chosen), zero)

    def table(self, *also: str) -> CsvTable:
        """Return the cells of the file; the columns `also` have to be there too. Raises InputError."""
        names = (self.time, *(n for c in self.columns.values() for n in (c.name, c.noise_std)), *also)
        return read_table(self.path, self.layout, [name for name in names if name is not None])

    def recording(self, table: CsvTable) -> Recording:
        """Return the recording of a table with these columns. Raises InputError; warns of stamps in another unit."""
        cells = _Cells(self.path, table, self.layout)
        stamps, origin = cells.stamps(self.time, self.clock), self.origin
        if self.between:
            first = cells.first([column.name for column in self.columns.values()], stamps)
            origin = zero_of(origin, self.clock.absolute, first)
            inside = rows_between(stamps, self.between, origin)
            chosen = CsvTable(table.header, [table.lines[i] for i in inside], [table.rows[i] for i in inside])
            cells, stamps = _Cells(self.path, chosen, self.layout), [stamps[i] for i in inside]
        rows = Rows(
            str(self.path),
            [f"line {line}" for line in cells.table.lines],
            stamps,
            {name: cells.numbers(column.name, column.scale, column.offset) for name, column in self.columns.items()},
            {
                name: cells.numbers(column.noise_std, abs(column.scale))
                for name, column in self.columns.items()
                if column.noise_std is not None
            },
        )
        return recording_of_table(rows, self.clock, self.repairs, origin)


def column_given(signal: str, wanted: object) -> Column:
    """Return a column that is given as such, or by its name. InputError: anything else."""
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

    def numbers(self, name: str, scale: float, offset: float = 0.0) -> Array:
        mark = self.layout.decimal
        found = self._converted(name, lambda cell: scaled(parse(cell, mark), scale, offset))
        return np.array([np.nan if number is None else number for number in found])

    def first(self, names: Sequence[str], stamps: Sequence[Decimal | None]) -> Decimal:
        """Return the first stamp [s] of a row that has a value in one of these columns; 0 where there is none."""
        at = [self.table.header.index(name) for name in names]
        pairs = zip(stamps, self.table.rows, strict=True)
        return min(
            (t for t, row in pairs if t is not None and not all(self.layout.is_missing(row[i]) for i in at)),
            default=Decimal(0),
        )

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
        return f"; if it stands for no value, name it in `missing` of the layout beside {others}"
