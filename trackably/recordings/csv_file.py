"""Read recordings from CSV files."""

from __future__ import annotations

import codecs
import csv
import io
import re
from collections.abc import Collection, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass
from pathlib import Path

from trackably.arguments import instance, names, text
from trackably.errors import InputError
from trackably.files import path_of, read_bytes
from trackably.recordings.clocks import DECIMAL_MARKS, POINT, Clock, Origin
from trackably.recordings.recording import Recording
from trackably.recordings.rows import Repair
from trackably.recordings.tables import Column, Reading, Table, recording_of, refuse_other_kinds

_MARKS = {
    codecs.BOM_UTF8: "utf-8-sig",
    codecs.BOM_UTF32_LE: "utf-32",  # before UTF-16, whose mark is the start of this one
    codecs.BOM_UTF16_LE: "utf-16",
    codecs.BOM_UTF16_BE: "utf-16",
}
"""Encodings by the byte order marks with which their files begin."""


def read_text(path: Path, encoding: str) -> str:
    """Return the whole text of a file; a byte order mark overrides the `encoding`.

    InputError: it is unreadable, or not in this encoding.
    """
    data = read_bytes(path)
    refuse_other_kinds(path, data)
    encoding = next((marked for mark, marked in _MARKS.items() if data.startswith(mark)), encoding)
    try:
        has_nul_bytes = codecs.lookup(encoding).name.startswith(("utf-16", "utf-32"))
        if not has_nul_bytes and (at := data.find(0)) >= 0:
            raise InputError(
                f"{path}, line {len(data[: at + 1].splitlines())}: a NUL byte, so this is no text file (unless the "
                "encoding 'utf-16-le' reads it)"
            )
        return data.decode(encoding)
    except LookupError as error:
        raise InputError(f"{path}: expected an encoding like 'utf-8' or 'latin-1', got {encoding!r}") from error
    except UnicodeError as error:
        hint = "" if has_nul_bytes else "; does the encoding 'latin-1' read it?"
        raise InputError(f"{path}: it is not written in {encoding!r} ({error}){hint}") from error


_NO_HEADER = ": if these are values, the file has no header, and `columns` of the layout names its columns"
_LATER = ": if line {} is the header, `skip` of the layout names the lines above it"
SEPARATORS = (",", ";", "\t")
MISSING = ("", "-", "na", "n/a", "nan", "null")


@dataclass(frozen=True)
class CsvLayout:
    """The format of a CSV file.

    `separator`: one character. By default, it is the one of comma, semicolon and tab that the first line has most often
    outside of quotes, and spaces if it has none of them. `decimal`: the decimal mark, "." or ",". `encoding`: its name
    in Python, if the file does not begin with a byte order mark. `comment`: lines that start with it are ignored; empty
    for none. `skip`: numbers, from 1, of further lines to ignore, such as units below the header. `missing`: texts that
    mean a missing value, in upper or lower case.
    `columns`: the names of the columns of a file without a header. TypeError, ValueError: a value is invalid.
    """

    separator: str | None = None
    decimal: str = POINT
    encoding: str = "utf-8"
    comment: str = "#"
    skip: Collection[int] = ()
    missing: Sequence[str] = MISSING
    columns: Sequence[str] = ()

    def __post_init__(self) -> None:
        text("CSV layout: encoding", self.encoding)
        text("CSV layout: comment", self.comment)
        instance("CSV layout: skip", self.skip, tuple | list | range | Set, "a list of line numbers")
        names("CSV layout: missing", self.missing)
        names("CSV layout: columns", self.columns)
        if self.decimal not in DECIMAL_MARKS:
            raise ValueError(f"CSV layout: expected a point or a comma as decimal mark, got {self.decimal!r}")
        if self.separator is not None and not re.fullmatch(r'[^"\r\n]', text("CSV layout: separator", self.separator)):
            raise ValueError(f"CSV layout: expected one character as separator, got {self.separator!r}")


PLAIN = CsvLayout()
"""Decimal points, UTF-8, and the separator found in the header."""


def csv_table(path: str | Path, layout: CsvLayout, wanted: Collection[str] | None = None) -> Table:
    """Read the columns `wanted`, by default all.

    InputError: a row is unreadable or too short, or a column is missing or repeated.
    """
    instance("layout", layout, CsvLayout, "a CsvLayout, as CsvLayout(separator=';')")
    path = path_of("path", path)
    lines = [
        (number, line)
        for number, line in enumerate(io.StringIO(read_text(path, layout.encoding), newline=""), start=1)
        if number not in layout.skip and not (layout.comment and line.startswith(layout.comment))
    ]
    separator = layout.separator or _separator(next((line for _, line in lines if line.strip()), ""))
    records = [*_records(path, lines, separator)]
    header = [*layout.columns] or [cell.strip() for cell in (records.pop(0)[1] if records else ())]
    _check_header(path, header, separator, layout, wanted, lines)
    for line, row in records:
        if len(row) < len(header) or any(row[len(header) :]):
            named = "the layout names" if layout.columns else "in the header"
            raise InputError(
                f"{path}, line {line}: expected {len(header)} cells, as {named}, got {len(row)}; is the line whole?"
            )
    while records and not any(map(str.strip, records[-1][1])):  # spreadsheets may end with empty rows
        del records[-1]
    if not records:
        raise InputError(f"{path}: there are no rows{'' if layout.columns else ' below the header'}")
    missing = {text.casefold() for text in layout.missing}
    columns = {
        name: [None if (cell := row[i]).strip().casefold() in missing else cell for _, row in records]
        for name, i in ((name, header.index(name)) for name in (header if wanted is None else wanted))
    }
    others = ", ".join(map(repr, layout.missing)) or "nothing"
    advice = (
        f"; if it stands for no value, name it in `missing` of the layout beside {others}; if the line holds units or "
        "notes, name its number in `skip`"
    )
    return Table(str(path), [f"line {line}" for line, _ in records], columns, layout.decimal, advice=advice)


def _separator(line: str) -> str:
    """Return the separator that a line has most often outside of quotes; a space if it has none."""
    unquoted = re.sub(r'"[^"]*"', "", line)
    return max(SEPARATORS, key=unquoted.count) if {*SEPARATORS} & {*unquoted} else " "


def _check_header(
    path: Path,
    header: Sequence[str],
    separator: str,
    layout: CsvLayout,
    wanted: Collection[str] | None,
    lines: Sequence[tuple[int, str]],
) -> None:
    """Raise InputError if there is no header, or it does not have each of the `wanted` names once."""
    if not header:
        raise InputError(f"{path}: expected a header that names the columns, got an empty file")
    names = header if wanted is None else wanted
    for name in names:
        if name not in header:
            listed = ", ".join(map(repr, header))
            is_value = not layout.columns and all(of[:1] in {*"+-.0123456789", ""} for of in header)
            cells = ((number, line.split(layout.separator or _separator(line))) for number, line in lines[1:])
            later = [number for number, of in cells if {*names} & {cell.strip('" \r\n') for cell in of}]
            hint = _NO_HEADER if is_value else _LATER.format(later[0]) if later else ""
            raise InputError(
                f"{path}: there is no column {name!r}; with the separator {separator!r} there are {listed}{hint}"
            )
        if header.count(name) > 1:
            raise InputError(f"{path}: expected one column {name!r}, got {header.count(name)}")


def _records(path: Path, lines: Sequence[tuple[int, str]], separator: str) -> Iterator[tuple[int, list[str]]]:
    """Yield each row that is not blank, with the number of the line on which it ends.

    `lines` have their numbers. InputError: one is not valid CSV.
    """
    reader = csv.reader((line for _, line in lines), delimiter=separator, skipinitialspace=True, strict=True)
    try:
        for row in reader:
            if row and (len(row) > 1 or row[0].strip()):
                yield lines[reader.line_num - 1][0], row
    except csv.Error as error:
        at = lines[reader.line_num - 1][0]
        raise InputError(
            f"{path}, line {at}: expected CSV with the separator {separator!r}, got a line that is none ({error}); "
            "mend it, or give another `separator` in the layout, or lines to `skip`, such as a title above the header"
        ) from error


def read_csv(
    path: str | Path,
    time: str | Sequence[str] | None,
    time_unit: str | Clock,
    signals: Mapping[str, Column | str],
    layout: CsvLayout = PLAIN,
    repairs: Sequence[Repair | str] = (),
    origin: Origin = None,
) -> Recording:
    """Read signals from a CSV file, with a header or with names in the layout.

    Parameters
    ----------
    path
        The file.
    time
        The column of time stamps; several, such as ("Date", "Time"), if their texts, joined by spaces, make one stamp.
        None for a file without time stamps: its rows are counted from 0, as `frames(rate)` expects.
    time_unit
        The name of a clock in `CLOCKS` ("s", "ms", "epoch ns", "ISO 8601", …), or a clock: `frames(rate)`, `DateTimes`.
    signals
        By the name that a signal gets in the recording: a `Column`, or the name of a column.
    layout
        Separator, decimal mark, encoding, comments, lines to skip, texts that mean a missing value, and the names
        of columns if there is no header.
    repairs
        Functions, or names of `REPAIRS`, applied in this order. Remaining errors are refused.
    origin
        The time zero [ns] on the file's clock, or "first" for the first sample of all signals. By default the file's
        own zero, or the first sample if stamps are dates or count from 1970.

    Cells without a value are left out and reported in `Recording.cleanings`.

    Warns
    -----
    DoubtfulInputWarning
        If rows are sorted or dropped because of their times, and the clock seems to start again. If times lie after
        the year 2100, as milliseconds do that are read as seconds since 1970.

    Raises
    ------
    InputError
        For a file that cannot be read, and for any error in it that no repair removes; names file and line.
    TypeError, ValueError
        For a wrong argument, before anything is read.
    """
    reading = Reading(time, time_unit, signals, repairs, origin)
    return recording_of((reading, csv_table(path, layout, reading.names)))
