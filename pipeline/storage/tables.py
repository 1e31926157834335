"""Numbers from and to CSV files, and a table that notebooks show."""

import csv
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from trackably.arrays import Array
from trackably.errors import InputError
from trackably.files import unreadable


def read_columns(path: Path) -> dict[str, Array]:
    """Return the columns of a CSV file of numbers by name; an empty cell is NaN.

    Raises InputError that names file, line and column.
    """
    try:
        with path.open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
    except OSError as error:
        raise unreadable(path, error) from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path}: cannot be read ({error})") from error
    if not rows:
        raise InputError(f"{path}: holds no rows below its header")
    return {
        name: np.array([_number(path, line, name, row[name]) for line, row in enumerate(rows, start=2)])
        for name in rows[0]
    }


def to_csv(columns: Mapping[str, Array]) -> str:
    """Return named columns as CSV. Numbers are the shortest text that reads back the same; NaN is an empty cell."""
    rows = zip(*columns.values(), strict=True)
    return "\n".join([",".join(columns), *(",".join(map(_csv_cell, row)) for row in rows)]) + "\n"


def _csv_cell(value: float) -> str:
    return "" if np.isnan(value) else str(int(value)) if value == int(value) else repr(float(value))


def _number(path: Path, line: int, name: str, cell: str | None) -> float:
    if cell == "":
        return math.nan
    try:
        return float(cell or "")
    except ValueError:
        raise InputError(f"{path}, line {line}: expected a number in column {name!r}, got {cell!r}") from None


@dataclass(frozen=True)
class Table:
    """Rows of text and numbers under column names; floats are shown with `digits` significant digits."""

    columns: Sequence[str]
    rows: Sequence[Sequence[object]]
    digits: int = 6

    def _repr_markdown_(self) -> str:
        lines = [self.columns, ["---"] * len(self.columns), *([self._cell(v) for v in row] for row in self.rows)]
        return "\n".join("| " + " | ".join(line) + " |" for line in lines)

    def __str__(self) -> str:
        return self._repr_markdown_()

    def _cell(self, value: object) -> str:
        match value:
            case None:
                return "–"
            case bool():
                return "yes" if value else "no"
            case float():
                return f"{value:.{self.digits}g}"
        return str(value)
