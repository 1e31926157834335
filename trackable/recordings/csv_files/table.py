"""Split a CSV file into named columns of cells, with the line number of each row."""

import csv
import io
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from pathlib import Path

from trackable.errors import InputError
from trackable.recordings.csv_files.text_file import read_text
from trackable.recordings.decimals import DECIMAL_MARKS, POINT

SEPARATORS = (",", ";", "\t")
MISSING = ("", "-", "na", "n/a", "nan", "null")


@dataclass(frozen=True)
class CsvLayout:
    """The format of a CSV file.

    `separator`: one character; None finds comma, semicolon or tab by the header. `decimal`: the mark in front of a
    fraction, "." or ",". `encoding`: as Python names it. `comment`: lines that start with it are ignored; none if it is
    empty. `skip`: numbers, from 1, of further lines to ignore, such as units below the header. `missing`: texts that
    stand for a missing value, in upper or lower case. InputError: an impossible value.
    """

    separator: str | None = None
    decimal: str = POINT
    encoding: str = "utf-8"
    comment: str = "#"
    skip: Collection[int] = ()
    missing: Collection[str] = MISSING

    def __post_init__(self) -> None:
        if self.decimal not in DECIMAL_MARKS:
            raise InputError(f"CSV layout: expected a point or a comma as decimal mark, got {self.decimal!r}")
        if self.separator is not None and (len(self.separator) != 1 or self.separator in '"\r\n'):
            raise InputError(f"CSV layout: expected one character as separator, got {self.separator!r}")
        if isinstance(self.missing, str):
            raise InputError(f"CSV layout: expected a list of texts that stand for no value, got {self.missing!r}")

    def is_missing(self, cell: str) -> bool:
        """Whether the cell stands for a missing value."""
        return cell.strip().casefold() in self._missing

    @cached_property
    def _missing(self) -> frozenset[str]:
        return frozenset(text.casefold() for text in self.missing)


PLAIN = CsvLayout()
"""Decimal points, UTF-8, and the separator found in the header."""


@dataclass(frozen=True)
class CsvTable:
    """The header, the rows below it (as long as the header), and the number of the line on which each row ends."""

    header: Sequence[str]
    lines: Sequence[int]
    rows: Sequence[Sequence[str]]


def read_table(path: Path, layout: CsvLayout, names: Collection[str]) -> CsvTable:
    """Read all cells. InputError: unreadable or ragged, or a column of `names` is missing or appears twice."""
    text = read_text(path, layout.encoding)
    separator, header = _header(path, text, layout, names)
    lines, rows = [], []
    try:
        for line, row in islice(_records(text, layout, separator), 1, None):
            if len(row) < len(header) or any(row[len(header) :]):
                raise InputError(
                    f"{path}, line {line}: expected {len(header)} cells, as in the header, got {len(row)}: is it whole?"
                )
            lines.append(line)
            rows.append(row)
    except _NoCsvError as error:
        raise InputError(f"{path}, {error}") from error
    if not rows:
        raise InputError(f"{path}: there are no rows below the header")
    return CsvTable(header, lines, rows)


def _header(path: Path, text: str, layout: CsvLayout, names: Collection[str]) -> tuple[str, list[str]]:
    """Return the separator and the names in the header: with this separator most of `names` are found."""
    found = {}
    refused = []
    for separator in SEPARATORS if layout.separator is None else (layout.separator,):
        try:
            found[separator] = [name.strip() for name in next(_records(text, layout, separator), (0, []))[1]]
        except _NoCsvError as error:
            refused.append(error)  # as when another separator follows a quoted name
    if not found:
        raise InputError(f"{path}, {refused[0]}") from refused[0]
    if not any(found.values()):
        raise InputError(f"{path}: expected a header that names the columns, got an empty file")
    separator, header = max(found.items(), key=lambda item: (sum(name in item[1] for name in names), len(item[1])))
    for name in names:
        if name not in header:
            listed = ", ".join(map(repr, header))
            raise InputError(
                f"{path}: there is no column {name!r}; with the separator {separator!r} there are {listed}"
            )
        if header.count(name) > 1:
            raise InputError(f"{path}: expected one column {name!r}, got {header.count(name)}")
    return separator, header


class _NoCsvError(Exception):
    """A line that is not valid CSV."""


def _records(text: str, layout: CsvLayout, separator: str) -> Iterator[tuple[int, list[str]]]:
    """Yield each row that is not blank, with the number of the line on which it ends."""
    line = 0

    def lines() -> Iterator[str]:
        nonlocal line
        for content in io.StringIO(text, newline=""):
            line += 1
            if line not in layout.skip and not (layout.comment and content.startswith(layout.comment)):
                yield content

    try:
        for row in csv.reader(lines(), delimiter=separator, skipinitialspace=True, strict=True):
            if row and (len(row) > 1 or row[0].strip()):
                yield line, row
    except csv.Error as error:
        raise _NoCsvError(f"line {line}: no CSV with the separator {separator!r} ({error})") from error
