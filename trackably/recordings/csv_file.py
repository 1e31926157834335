"""Read recordings from CSV files."""

from __future__ import annotations

import codecs
import csv
import gzip
import io
import zlib
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from io import BytesIO
from itertools import islice
from pathlib import Path

from trackably.errors import InputError
from trackably.files import read_bytes
from trackably.recordings.clocks import DECIMAL_MARKS, POINT, Clock, DateTimes, Origin, parse
from trackably.recordings.recording import Recording
from trackably.recordings.rows import Repair
from trackably.recordings.tables import (
    GZIP,
    LARGEST,
    MCAP,
    Cells,
    Column,
    Form,
    TableReading,
    path_given,
    recording_of,
    refuse_other_kinds,
)

_UTF8 = ("utf-8", "utf-8-sig")
_UTF8_MARK = b"\xef\xbb\xbf"
_UTF16_MARKS = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)


def read_text(path: Path, encoding: str) -> str:
    """Return the whole text of a file, unpacked if it is a gzip file, without a byte order mark of UTF-8.

    InputError: it is unreadable, or not in `encoding`.
    """
    data = _unpack(path, read_bytes(path))
    try:
        _refuse_no_text(path, data, encoding)
        return data.removeprefix(_UTF8_MARK).decode(encoding)
    except LookupError as error:
        raise InputError(f"{path}: expected an encoding like 'utf-8' or 'latin-1', got {encoding!r}") from error
    except UnicodeError as error:
        hint = "" if _has_nul_bytes(encoding) else "; does the encoding 'latin-1' read it?"
        raise InputError(f"{path}: it is not written in {encoding!r} ({error}){hint}") from error


def _unpack(path: Path, data: bytes) -> bytes:
    """Unpack a gzip file; return any other data unchanged."""
    if not data.startswith(GZIP):
        return data
    try:
        with gzip.open(BytesIO(data)) as packed:
            found = packed.read(LARGEST + 1)
    except (OSError, EOFError, zlib.error) as error:
        raise InputError(f"{path}: a gzip file that cannot be unpacked ({error}): is it whole?") from error
    if len(found) > LARGEST:
        raise InputError(f"{path}: this gzip file unpacks to more than {LARGEST} bytes: unpack it and leave out a part")
    return found


def _refuse_no_text(path: Path, data: bytes, encoding: str) -> None:
    if data.startswith(MCAP):
        raise InputError(f"{path}: this is an MCAP file, which read_mcap reads")
    refuse_other_kinds(path, data)
    if data.startswith(_UTF8_MARK) and codecs.lookup(encoding).name not in _UTF8:
        raise InputError(f"{path}: it begins with the mark of UTF-8, but its encoding is said to be {encoding!r}")
    if _has_nul_bytes(encoding):
        return
    if data.startswith(_UTF16_MARKS):
        raise InputError(f"{path}: it begins with the mark of UTF-16, which the encoding 'utf-16' reads")
    if (at := data.find(0)) >= 0:
        line = len(data[: at + 1].splitlines())
        raise InputError(
            f"{path}, line {line}: a NUL byte, so this is no text file (unless the encoding 'utf-16-le' reads it)"
        )


def _has_nul_bytes(encoding: str) -> bool:
    return codecs.lookup(encoding).name.startswith(("utf-16", "utf-32"))


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

    `separator`: one character; None detects comma, semicolon or tab by the header. `decimal`: the decimal mark, "." or
    ",". `encoding`: its name in Python. `comment`: lines that start with it are ignored; empty for none. `skip`:
    numbers, from 1, of further lines to ignore, such as units below the header. `missing`: texts that mean a missing
    value, in upper or lower case. `columns`: the names of the columns of a file without a header. Messages about files
    use these names, which are the same in files that describe recordings. InputError: a value is invalid.
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
        """Whether the cell means a missing value."""
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


def read_cells(path: Path, layout: CsvLayout, names: Collection[str] | None = None) -> Cells:
    """Read the columns `names`, by default all.

    InputError: a row is unreadable or too short, or a column is missing or repeated.
    """
    text = read_text(path, layout.encoding)
    separator, header = _header(path, text, layout, names)
    lines, rows = [], []
    try:
        for line, row in islice(_records(text, layout, separator), 0 if layout.columns else 1, None):
            if len(row) < len(header) or any(row[len(header) :]):
                named = "the layout names" if layout.columns else "in the header"
                raise InputError(
                    f"{path}, line {line}: expected {len(header)} cells, as {named}, got {len(row)}: is it whole?"
                )
            lines.append(line)
            rows.append(row)
    except csv.Error as error:
        raise InputError(f"{path}, {error}") from error
    if not rows:
        raise InputError(f"{path}: there are no rows{'' if layout.columns else ' below the header'}")
    at = {name: header.index(name) for name in (header if names is None else names)}
    return Cells({name: [row[i] for row in rows] for name, i in at.items()}, [f"line {line}" for line in lines])


def csv_table(
    path: str | Path,
    time: str | None,
    time_unit: str | Clock,
    signals: Mapping[str, Column | str],
    layout: CsvLayout,
    repairs: Sequence[Repair | str],
    origin: Origin,
    between: tuple[float, float] | None = None,
    also: Sequence[str] = (),
) -> tuple[TableReading, Cells]:
    """Return the arguments of `read_csv`, checked, and the cells of its columns and of those in `also`.

    Raises InputError.
    """
    if not isinstance(layout, CsvLayout):
        raise InputError(f"layout: expected a CsvLayout, as CsvLayout(separator=';'), got {layout!r}")
    if not isinstance(time, str | None):
        raise InputError(f"time: expected the name of a column, or None to count rows, got {time!r}")

    def hint(cell: str) -> str:
        if cell.strip().lstrip("+-.,")[:1].isdigit():
            return ""  # a value, but in another format
        others = ", ".join(map(repr, layout.missing)) or "nothing"
        return (
            f"; if it stands for no value, name it in `missing` of the layout beside {others}; if the line holds units "
            "or notes, name its number in `skip`"
        )

    form = Form("column", layout.is_missing, lambda cell: parse(cell, layout.decimal), DateTimes.seconds, hint)
    file = path_given(path)
    reading = TableReading.of(str(file), form, time, time_unit, signals, repairs, origin, between)
    return reading, read_cells(file, layout, [*dict.fromkeys((*reading.names, *also))])


def _header(path: Path, text: str, layout: CsvLayout, wanted: Collection[str] | None) -> tuple[str, list[str]]:
    """Return the separator and the names in the header.

    A separator is chosen by the number of wanted names it finds.
    """
    names, firsts, refused = () if layout.columns else wanted or (), {}, []
    for separator in _separators(layout):
        try:
            firsts[separator] = [cell.strip() for cell in next(_records(text, layout, separator), (0, []))[1]]
        except csv.Error as error:
            refused.append(error)  # as when another separator follows a quoted name
    if not firsts:
        raise InputError(f"{path}, {refused[0]}") from refused[0]
    if not any(firsts.values()):
        raise InputError(f"{path}: expected a header that names the columns, got an empty file")
    separator = max(firsts, key=lambda separator: (sum(name in firsts[separator] for name in names),
                                                   len(firsts[separator])))  # fmt: skip
    header = [*layout.columns] or firsts[separator]
    for name in header if wanted is None else wanted:
        if name not in header:
            listed, hint = ", ".join(map(repr, header)), ""
            if not layout.columns:
                is_value = all(name[:1] in {*"+-.0123456789"} for name in header)
                hint = _NO_HEADER if is_value else _header_below(text, layout, names)
            raise InputError(
                f"{path}: there is no column {name!r}; with the separator {separator!r} there are {listed}{hint}"
            )
        if header.count(name) > 1:
            raise InputError(f"{path}: expected one column {name!r}, got {header.count(name)}")
    return separator, header


def _header_below(text: str, layout: CsvLayout, names: Collection[str]) -> str:
    """Return a hint at the first later line that names all columns, such as a header below a title.

    "" if there is none.
    """
    for separator in _separators(layout):
        with suppress(csv.Error):
            for line, cells in islice(_records(text, layout, separator), 1, _TITLE):
                if {cell.strip() for cell in cells}.issuperset(names):
                    return f"; line {line} names all of them: `skip` of the layout leaves out the lines above it"
    return ""


def _separators(layout: CsvLayout) -> Sequence[str]:
    return SEPARATORS if layout.separator is None else (layout.separator,)


def _records(text: str, layout: CsvLayout, separator: str) -> Iterator[tuple[int, list[str]]]:
    """Yield each row that is not blank, with the number of the line on which it ends.

    csv.Error: a line is not valid CSV; the message begins with its number.
    """
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
        raise csv.Error(f"line {line}: no CSV with the separator {separator!r} ({error})") from error


def read_csv(
    path: str | Path,
    time: str | None,
    time_unit: str | Clock,
    signals: Mapping[str, Column | str],
    layout: CsvLayout = PLAIN,
    repairs: Sequence[Repair | str] = (),
    origin: Origin = None,
    between: tuple[float, float] | None = None,
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
        Separator, decimal mark, encoding, comments, lines to skip, texts that mean a missing value, and the names
        of columns if there is no header. `TUM` and `KITTI` are layouts.
    repairs
        Functions, or names of `REPAIRS`, applied in this order. Remaining errors are refused.
    origin
        The time zero [ns] on the file's clock, or "first" for the first sample of all signals. By default the file's
        own zero, or the first sample if stamps are dates or count from 1970.
    between
        Read only the samples with start ≤ time ≤ end [s]; of other rows, only the time has to be readable.

    Cells without a value are left out and reported in `Recording.cleanings`.

    Warns
    -----
    DoubtfulInputWarning
        For implausible stamps, for example milliseconds that are read as seconds since 1970, and if
        `average_repeated` averages values at one time that differ by more than noise explains.

    Raises
    ------
    InputError
        For a file that cannot be read, and for any error in it that no repair removes; names file and line.
    """
    return recording_of(csv_table(path, time, time_unit, signals, layout, repairs, origin, between))
