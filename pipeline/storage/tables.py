"""Numbers from and to CSV files, and the tables that notebooks show."""

import csv
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.methods import LearnedReference
from pipeline.storage.results import Results
from trackably.arrays import Array
from trackably.errors import InputError
from trackably.files import read_json, unreadable
from trackably.learning.problem import ActiveBound


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


_COSTS = {"nlml": "l", "objective": "J", "price": "price"}
_ERRORS = {"misfit": "misfit", "rmse": "error to the truth", "held_out": "error on held-out samples"}


def table_of_methods(results: Results) -> Table:
    """Return l, J, the price, root mean square errors and whether there is a proof, for each method."""
    metrics: Any = read_json(results.metrics)
    first = next(iter(metrics.values()))
    errors = {
        key: _heading(key, kind) for kind in _ERRORS for key in first if key == kind or key.startswith(f"{kind}_")
    }
    columns = _COSTS | errors
    rows = [
        [method, *(found[key] for key in columns), found["proof"].startswith("proved")]
        for method, found in metrics.items()
    ]
    return Table(["", *columns.values(), "proved"], rows, digits=4)


def _heading(key: str, kind: str) -> str:
    name = key.removeprefix(kind).removeprefix("_")
    return f"{_ERRORS[kind]}, {name}" if name else _ERRORS[kind]


def table_of_hyperparameters(learned: Mapping[str, LearnedReference]) -> Table:
    """Return what each method learned, and k̄ at the end of Algorithm 1 where it was run."""
    names = next(iter(learned.values())).prior.hyperparameters
    rows: list[list[object]] = [
        [name, *(found.prior.hyperparameters[name] for found in learned.values())] for name in names
    ]
    steps = [found.final_step for found in learned.values()]
    if any(step is not None for step in steps):
        rows.append(["last step k̄ of Algorithm 1", *steps])
    return Table(["", *learned], rows)


def table_of_bounds(active: tuple[ActiveBound, ...]) -> Table:
    """Return the bounds that hold a reference back, with their times and what each costs, in the order of time."""
    ordered = sorted(active, key=lambda bound: (bound.time, bound.name))
    rows = [[bound.name, bound.side, bound.time, bound.multiplier, bound.price] for bound in ordered]
    return Table(["bound of", "side", "t [s]", "multiplier", "price"], rows, digits=4)
