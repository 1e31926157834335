"""Split a CSV file into named columns of cells, with the line number of each row."""

import csv
import io
from collections.abc import Collection, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from pathlib import Path

from trackably.errors import InputError
from trackably.recordings.csv_files.text_file import read_text
from trackably.recordings.decimals import DECIMAL_MARKS, POINT

_NO_HEADER = (
    ": if these are values, the file has no header, and `columns` of the layout names its columns (TUM and KITTI are "
    "such layouts)"
)
SEPARATORS = (",", ";", "\t")
_TITLE = 100  # lines at most above a header
MISSING = ("", "-", "na", "n/a", "nan", "null")


@dataclass(frozen=True)
class CsvLayout:
    """The format of a CSV file.

    `separator`: one character; None finds comma, semicolon or tab by the header. `decimal`: the mark in front of a
    fraction, "." or ",". `encoding`: as Python names it. `comment`: lines that start with it are ignored; none if it is
    empty. `skip`: numbers, from 1, of further lines to ignore, such as units below the header. `missing`: texts that
    stand for a missing value, in upper or lower case. `columns`: the names of the columns of a file without a header.
    Messages about files name these fields, which have the same names in files that describe recordings.
    InputError: an impossible value.
    """

    separator: str | None = None
    decimal: str = POINT
    encoding: str = "utf-8"
    comment: str = "#"
    skip: Collection[int] = ()
    missing: Collection[str] = MISSING
    columns: Collection[str] = ()

    def __post_init__(self) -> None:
        for name, wanted, described in (
            ("separator", str | None, "one character, or None"),
            ("encoding", str, "an encoding like 'utf-8' or 'latin-1'"),
            ("comment", str, "the beginning of lines to ignore"),
            ("skip", Collection, "the numbers of lines"),
            ("missing", Collection, "a list of texts that stand for no value"),
            ("columns", Collection, "a list of names"),
        ):
            if not isinstance(given := getattr(self, name), wanted) or (
                wanted is Collection and isinstance(given, str)
            ):
                raise InputError(f"CSV layout: {name}: expected {described}, got {given!r}")
        for name in ("missing", "columns"):
            if wrong := [entry for entry in getattr(self, name) if not isinstance(entry, str)]:
                raise InputError(f"CSV layout: {name}: expected texts, got {wrong[0]!r}")
        if self.decimal not in DECIMAL_MARKS:
            raise InputError(f"CSV layout: expected a point or a comma as decimal mark, got {self.decimal!r}")
        if self.separator is not None and (len(self.separator) != 1 or self.separator in '"\r\n'):
            raise InputError(f"CSV layout: expected one character as separator, got {self.separator!r}")

    def is_missing(self, cell: str) -> bool:
        """Whether the cell stands for a missing value."""
        return cell.strip().casefold() in self._missing

    @cached_property
    def _missing(self) -> frozenset[str]:
        return frozenset(text.casefold() for text in self.missing)


PLAIN = CsvLayout()
"""Decimal points, UTF-8, and the separator found in the header."""

TUM = CsvLayout(" ", columns=("t", "x", "y", "z", "qx", "qy", "qz", "qw"))
"""Trajectories of the TUM RGB-D benchmark: t in seconds since 1970, position, quaternion; no header."""

KITTI = CsvLayout(" ", columns=("r11", "r12", "r13", "x", "r21", "r22", "r23", "y", "r31", "r32", "r33", "z"))
"""Poses of the KITTI odometry benchmark: the rows of [R t], one pose a frame; neither header nor stamps."""


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
        for line, row in islice(_records(text, layout, separator), 0 if layout.columns else 1, None):
            if len(row) < len(header) or any(row[len(header) :]):
                raise InputError(
                    f"{path}, line {line}: expected {len(header)} cells, as {_named_in(layout)}, got {len(row)}: "
                    "is it whole?"
                )
            lines.append(line)
            rows.append(row)
    except _NoCsvError as error:
        raise InputError(f"{path}, {error}") from error
    if not rows:
        raise InputError(f"{path}: there are no rows{'' if layout.columns else ' below the header'}")
    return CsvTable(header, lines, rows)


def _header(path: Path, text: str, layout: CsvLayout, names: Collection[str]) -> tuple[str, list[str]]:
    """Return the separator and the names in the header: with this separator most of `names` are found."""
    found = {}
    refused = []
    for separator in SEPARATORS if layout.separator is None else (layout.separator,):
        try:
            first = next(_records(text, layout, separator), (0, []))[1]
            found[separator] = [*layout.columns] if layout.columns and first else [name.strip() for name in first]
        except _NoCsvError as error:
            refused.append(error)  # as when another separator follows a quoted name
    if not found:
        raise InputError(f"{path}, {refused[0]}") from refused[0]
    if not any(found.values()):
        raise InputError(f"{path}: expected a header that names the columns, got an empty file")
    separator, header = max(found.items(), key=lambda item: (sum(name in item[1] for name in names), len(item[1])))
    if layout.columns:  # no header tells the separator: the first row has as many cells
        separator = max(found, key=lambda separator: len(next(_records(text, layout, separator))[1]))
    for name in names:
        if name not in header:
            listed = ", ".join(map(repr, header))
            hint = "" if layout.columns else _header_below(text, layout, names)
            if not layout.columns and all(map(_looks_like_a_number, header)):
                hint = _NO_HEADER
            raise InputError(
                f"{path}: there is no column {name!r}; with the separator {separator!r} there are {listed}{hint}"
            )
        if header.count(name) > 1:
            raise InputError(f"{path}: expected one column {name!r}, got {header.count(name)}")
    return separator, header


def _header_below(text: str, layout: CsvLayout, names: Collection[str]) -> str:
    """Return a hint at the first line further down that names all columns, as below a title; nothing without one."""
    for separator in SEPARATORS if layout.separator is None else (layout.separator,):
        with suppress(_NoCsvError):
            for line, cells in islice(_records(text, layout, separator), 1, _TITLE):
                if {cell.strip() for cell in cells}.issuperset(names):
                    return f"; line {line} names all of them: `skip` of the layout leaves out the lines above it"
    return ""


def _named_in(layout: CsvLayout) -> str:
    return "the layout names" if layout.columns else "in the header"


def _looks_like_a_number(name: str) -> bool:
    return name[:1] in set("+-.0123456789")


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
