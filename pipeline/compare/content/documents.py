"""Read JSON documents and CSV tables as values at places."""

import csv
import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from io import StringIO

from pipeline.compare.content.prose import prose_leaves
from pipeline.compare.content.values import Leaf, Leaves, Part, UnreadableError
from pipeline.compare.model import Value


def read_json(data: bytes) -> object:
    """Read JSON with NaN and infinities: a comparison has to say where they are. Raises UnreadableError."""
    try:
        content: object = json.loads(data.decode())
    except (ValueError, RecursionError) as error:
        raise UnreadableError(f"no JSON: {error}") from error
    return content


def json_leaves(content: object) -> Leaves:
    """Return every value by its path: `sound.tail.start`, `weights[3]`."""
    return {path: Leaf(path, value) for path, value in _walk(content, "")}


def told_leaves(content: object) -> Leaves:
    """Return the same, with sentences taken apart: the words are at `proof`, its numbers at `proof, number 1` …"""
    leaves: dict[str, Leaf] = {}
    for path, leaf in json_leaves(content).items():
        sentence = isinstance(leaf.value, str) and " " in leaf.value
        leaves.update(prose_leaves(path, str(leaf.value), path, path) if sentence else {path: leaf})
    return leaves


def _walk(content: object, path: str) -> Iterator[tuple[str, Value]]:
    match content:
        case dict() if content:
            for key, value in content.items():
                yield from _walk(value, f"{path}.{key}" if path else str(key))
        case list() if content:
            for i, value in enumerate(content):
                yield from _walk(value, f"{path}[{i}]")
        case dict() | list():
            yield path, "empty"
        case float() | int() | str() | bool() | None:
            yield path, content


def json_parts(base: object, new: object) -> list[Part]:
    """Return one part, whose places are paths."""
    leaves = told_leaves(base), told_leaves(new)
    reordered = list(leaves[0]) != list(leaves[1]) and leaves[0].keys() == leaves[1].keys()
    return [Part("", "", *leaves, notes=("keys in another order",) if reordered else ())]


@dataclass(frozen=True)
class CsvTable:
    """A header, and rows of text that have its length."""

    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def read_csv(data: bytes) -> CsvTable:
    """Read a table. Raises UnreadableError where the header repeats a name, or a row has another length."""
    try:
        lines = [tuple(row) for row in csv.reader(StringIO(data.decode(), newline=""), strict=True)]
    except (UnicodeDecodeError, csv.Error) as error:
        raise UnreadableError(f"no CSV table: {error}") from error
    if not lines or len(set(lines[0])) != len(lines[0]):
        raise UnreadableError("no CSV table: the first line has to name the columns, each once")
    for number, line in enumerate(lines[1:], start=2):
        if len(line) != len(lines[0]):
            raise UnreadableError(f"line {number} has {len(line)} cells below a header of {len(lines[0])}")
    return CsvTable(lines[0], tuple(lines[1:]))


def csv_parts(base: CsvTable, new: CsvTable) -> list[Part]:
    """Return one part, whose places are column and row.

    Rows are paired by their first cells where these are distinct, and otherwise by their numbers.
    """
    keys = _keys(base), _keys(new)
    moved = []
    if sorted(base.columns) == sorted(new.columns) and base.columns != new.columns:
        moved.append("reordered: the same columns in another order")
    if set(keys[0]) & set(keys[1]):
        if where := _reordered(*keys):
            moved.append(where)
    elif base.columns == new.columns and base.rows != new.rows and sorted(base.rows) == sorted(new.rows):
        moved.append("reordered: the same rows in another order")
        return [Part("", "", {}, {}, moved=tuple(moved))]
    if not set(keys[0]) & set(keys[1]) or (len(base.rows) == len(new.rows) and set(keys[0]) != set(keys[1])):
        keys = _numbers(base), _numbers(new)
    return [Part("", "", _table_leaves(base, keys[0]), _table_leaves(new, keys[1]), moved=tuple(moved))]


def _keys(table: CsvTable) -> Sequence[str]:
    """Name each row by its first cell; return no names where two rows would have the same."""
    first = [row[0] for row in table.rows]
    return [f"{table.columns[0]} = {cell}" for cell in first] if len(set(first)) == len(first) else []


def _numbers(table: CsvTable) -> Sequence[str]:
    return [f"line {number}" for number in range(2, len(table.rows) + 2)]


def _reordered(base: Sequence[str], new: Sequence[str]) -> str | None:
    """Say where rows that both sides have come in another order; None where they do not."""
    shared = set(base) & set(new)
    order = [key for key in base if key in shared], [key for key in new if key in shared]
    first = next((pair for pair in zip(*order, strict=True) if pair[0] != pair[1]), None)
    return first and f"reordered: the row {first[0]!r} of BASE has another place in NEW, where {first[1]!r} stands"


def _table_leaves(table: CsvTable, keys: Sequence[str]) -> Leaves:
    return {
        f"column {column}, {key}": Leaf(column, _cell(cell))
        for key, row in zip(keys, table.rows, strict=True)
        for column, cell in zip(table.columns, row, strict=True)
    }


def _cell(text: str) -> Value:
    """Return a number where the cell holds one, None where it is empty."""
    if not text:
        return None
    try:
        number = float(text)
    except ValueError:
        return text
    return int(number) if math.isfinite(number) and number.is_integer() and abs(number) < 2**53 else number


def numbers_of(table: CsvTable) -> dict[str, list[float]]:
    """Return the cells by column; NaN where a cell is not a number."""
    columns = {name: [_cell(row[i]) for row in table.rows] for i, name in enumerate(table.columns)}
    return {
        name: [float(cell) if isinstance(cell, int | float) else math.nan for cell in cells]
        for name, cells in columns.items()
    }
