"""A CSV file is read, or refused in one sentence that names file and line."""

import re
from pathlib import Path
from typing import Any

import pytest

from tests.trackably.recordings.csv_files.files import COMMAS, X, read
from trackably.errors import InputError
from trackably.files import unreadable
from trackably.recordings import Column, CsvLayout, DateTimes, read_csv


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "some.csv"


MISSING = "; if it stands for no value, name it in `missing` of the layout beside '', '-', 'na', 'n/a', 'nan', 'null'"
FORMATS = ' (DateTimes("%d.%m.%Y %H:%M:%S") as time unit reads other formats)'

REFUSALS: dict[str, tuple[str | bytes, dict[str, Any], str]] = {
    "empty": ("", {}, ": expected a header that names the columns, got an empty file"),
    "nothing but comments": ("# t,x\n", {}, ": expected a header that names the columns, got an empty file"),
    "no rows": ("t,x\n", {}, ": there are no rows below the header"),
    "no such column": (
        "t;a,b;y\n0;1;2\n",
        {},
        ": there is no column 'x'; with the separator ';' there are 't', 'a,b', 'y'",
    ),
    "no time": ("T,x\n0,1\n", {}, ": there is no column 't'; with the separator ',' there are 'T', 'x'"),
    "wrong separator": (
        "t;x\n0;1\n",
        {"layout": CsvLayout(separator=",")},
        ": there is no column 't'; with the separator ',' there are 't;x'",
    ),
    "wrong separator behind a quote": (
        '"t";"x"\n0;1\n',
        {"layout": CsvLayout(separator=",")},
        ", line 1: no CSV with the separator ',' (',' expected after '\"')",
    ),
    "no such noise": (
        "t,x\n0,1\n",
        {"signals": {"x": Column("x", noise_std="s")}},
        ": there is no column 's'; with the separator ',' there are 't', 'x'",
    ),
    "two columns of a name": ("t,x,x\n0,1,2\n", {}, ": expected one column 'x', got 2"),
    "text": ("t,x\n0,1\n\n1,one\n", {}, f", line 4, column 'x': expected a number, got 'one'{MISSING}"),
    "text as time": ("t,x\n0,1\nsoon,2\n", {}, f", line 3, column 't': expected a number, got 'soon'{MISSING}"),
    "infinity": ("t,x\n0,inf\n", {}, f", line 2, column 'x': expected a number, got 'inf'{MISSING}"),
    "decimal commas unsaid": (
        "t;x\n0;1,5\n",
        {},
        ", line 2, column 'x': expected a number, got '1,5' (with decimal=\",\" it would be one)",
    ),
    "points where commas were said": (
        "t;x\n0;1.5\n",
        {"layout": COMMAS},
        ", line 2, column 'x': expected a number, got '1.5' (with decimal=\".\" it would be one)",
    ),
    "thousands": ("t;x\n0;1.234,5\n", {"layout": COMMAS}, ", line 2, column 'x': expected a number, got '1.234,5'"),
    "too large": (
        "t,x\n0,1e400\n",
        {},
        ", line 2, column 'x': expected a number that fits a float64, got 1.000e+400 (times 1.0)",
    ),
    "dates where numbers were said": (
        "t,x\n2024-05-01T12:00:00Z,1\n",
        {},
        ", line 2, column 't': expected a number, got '2024-05-01T12:00:00Z'",
    ),
    "numbers where dates were said": (
        "t,x\n17,1\n",
        {"unit": "ISO 8601"},
        f", line 2, column 't': expected a stamp like 2024-05-01T12:00:00.25Z, got '17'{FORMATS}",
    ),
    "German dates where ISO 8601 was said": (
        "t,x\n02.03.2026 14:15:00,1\n",
        {"unit": "ISO 8601"},
        f", line 2, column 't': expected a stamp like 2024-05-01T12:00:00.25Z, got '02.03.2026 14:15:00'{FORMATS}",
    ),
    "ISO 8601 where another format was said": (
        "t,x\n2026-03-02 14:15:00,1\n",
        {"unit": DateTimes("%d.%m.%Y %H:%M:%S")},
        ", line 2, column 't': expected a stamp like 01.05.2024 13:00:00, got '2026-03-02 14:15:00'",
    ),
    "text as date": (
        "t,x\nFehler,1\n",
        {"unit": DateTimes("%d.%m.%Y %H:%M")},
        f", line 2, column 't': expected a stamp like 01.05.2024 13:00, got 'Fehler'{MISSING}",
    ),
    "text, others being missing": (
        "t,x\n0,Fehler\n",
        {"layout": CsvLayout(missing=("LOST", ""))},
        ", line 2, column 'x': expected a number, got 'Fehler'; if it stands for no value, "
        "name it in `missing` of the layout beside 'LOST', ''",
    ),
    "text, nothing being missing": (
        "t,x\n0,-\n",
        {"layout": CsvLayout(missing=())},
        ", line 2, column 'x': expected a number, got '-'; if it stands for no value, "
        "name it in `missing` of the layout beside nothing",
    ),
    "decimal commas without quotes": (
        "t,x\n0,1,5\n",
        {"layout": COMMAS},
        ", line 2: expected 2 cells, as in the header, got 3: is it whole?",
    ),
    "cut off": (
        "t,x,y\n0,1,2\n1,2",
        {},
        ", line 3: expected 3 cells, as in the header, got 2: is it whole?",
    ),
    "cut off in quotes": (
        't,x\n0,"1"\n1,"2',
        {},
        ", line 3: no CSV with the separator ',' (unexpected end of data)",
    ),
    "missing time": (
        "t,x\n0,1\n,2\n",
        {},
        ", line 3: the row has no time (drop_rows_without_time leaves such rows out)",
    ),
    "Latin-1 as UTF-8": (
        "t,x,größe\n0,1,2\n".encode("latin-1"),
        {},
        ": it is not written in 'utf-8' ('utf-8' codec can't decode byte 0xf6 in position 6: invalid start byte); "
        "does the encoding 'latin-1' read it?",
    ),
    "UTF-16 as UTF-8": (
        "t,x\n0,1\n".encode("utf-16"),
        {},
        ": it begins with the mark of UTF-16, which the encoding 'utf-16' reads",
    ),
    "UTF-16 without a mark": (
        "t,x\n0,1\n".encode("utf-16-le"),
        {},
        ", line 1: a NUL byte, so this is no text file (unless the encoding 'utf-16-le' reads it)",
    ),
    "UTF-16 cut off": (
        "t,x\n0,1\n".encode("utf-16")[:-1],
        {"layout": CsvLayout(encoding="utf-16")},
        ": it is not written in 'utf-16' ('utf-16-le' codec can't decode byte 0x0a in position 16: truncated data)",
    ),
    "zeros behind the text": (
        b"t,x\r\n0,1\r\n1,\0\0\0",
        {},
        ", line 3: a NUL byte, so this is no text file (unless the encoding 'utf-16-le' reads it)",
    ),
    "binary": (
        b"\x7fELF\n\xff\0\1",
        {},
        ", line 2: a NUL byte, so this is no text file (unless the encoding 'utf-16-le' reads it)",
    ),
    "binary as Latin-1": (
        b"\xff\0\1",
        {"layout": CsvLayout(encoding="latin-1")},
        ", line 1: a NUL byte, so this is no text file (unless the encoding 'utf-16-le' reads it)",
    ),
    "MCAP": (b"\x89MCAP0\r\n\1\0", {}, ": this is an MCAP file, which read_mcap reads"),
    "MCAP as Latin-1": (
        b"\x89MCAP0\r\n\1\0",
        {"layout": CsvLayout(encoding="latin-1")},
        ": this is an MCAP file, which read_mcap reads",
    ),
    "UTF-8 as Latin-1": (
        b"\xef\xbb\xbft,x\n0,1\n",
        {"layout": CsvLayout(encoding="latin-1")},
        ": it begins with the mark of UTF-8, but its encoding is said to be 'latin-1'",
    ),
    "unknown encoding": (
        "t,x\n0,1\n",
        {"layout": CsvLayout(encoding="latin-one")},
        ": expected an encoding like 'utf-8' or 'latin-1', got 'latin-one'",
    ),
    "no signal": ("t,x\n0,1\n", {"signals": {}}, ": expected at least one signal, got none"),
}


@pytest.mark.parametrize("name", REFUSALS)
def test_refused(path: Path, name: str) -> None:
    text, options, message = REFUSALS[name]
    with pytest.raises(InputError) as caught:
        read(path, text, **options)
    assert str(caught.value) == f"{path}{message}"


NO_FILES = {"none.csv": "there is no such file", ".": "expected a file, got a folder"}


def test_no_file(path: Path) -> None:
    for where, message in NO_FILES.items():
        with pytest.raises(InputError) as caught:
            read_csv(str(path.parent / where), "t", "s", X)
        assert str(caught.value) == f"{path.parent / where}: {message}"


def test_no_file_says_where_it_looked(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(path.parent)
    with pytest.raises(InputError) as caught:
        read_csv("data/some.csv", "t", "s", X)
    assert str(caught.value) == f"data/some.csv: there is no such file in {path.parent}"


def test_other_reasons_not_to_be_read(path: Path) -> None:
    """Nobody is refused for lack of a permission where tests run as root."""
    assert str(unreadable(path, PermissionError(13, "Permission denied"))) == (
        f"{path}: cannot be read (Permission denied)"
    )
    assert str(unreadable(path, OSError("nothing there"))) == f"{path}: cannot be read (nothing there)"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"decimal": ";"}, "CSV layout: expected a point or a comma as decimal mark, got ';'"),
        ({"separator": ", "}, "CSV layout: expected one character as separator, got ', '"),
        ({"separator": '"'}, "CSV layout: expected one character as separator, got '\"'"),
        ({"separator": ""}, "CSV layout: expected one character as separator, got ''"),
        ({"missing": "LOST"}, "CSV layout: missing: expected a list of texts that stand for no value, got 'LOST'"),
        ({"missing": [1]}, "CSV layout: missing: expected texts, got 1"),
        ({"columns": "t,x"}, "CSV layout: columns: expected a list of names, got 't,x'"),
        ({"skip": 2}, "CSV layout: skip: expected the numbers of lines, got 2"),
        ({"skip": "2"}, "CSV layout: skip: expected the numbers of lines, got '2'"),
        ({"encoding": None}, "CSV layout: encoding: expected an encoding like 'utf-8' or 'latin-1', got None"),
        ({"separator": [","]}, "CSV layout: separator: expected one character, or None, got [',']"),
    ],
)
def test_no_layout(options: dict[str, str], message: str) -> None:
    with pytest.raises(InputError) as caught:
        CsvLayout(**options)  # type: ignore[arg-type]
    assert str(caught.value) == message


@pytest.mark.parametrize("wanted", [("x", 1e-3), None, 2])
def test_no_column(path: Path, wanted: object) -> None:
    with pytest.raises(InputError) as caught:
        read(path, "t,x\n0,1\n", signals={"p": wanted})
    assert str(caught.value) == f"signal 'p': expected a Column, or the name of one, got {wanted!r}"


def test_what_is_chosen_is_checked_before_the_file_is_read(path: Path) -> None:
    for options, message in (
        ({"repairs": ["sort"]}, "there is no repair 'sort'; there are drop_rows_without_time, "),
        ({"origin": "nonsense"}, "origin: expected "),
    ):
        with pytest.raises(InputError, match=re.escape(message)):
            read_csv(path, "t", "s", X, **options)  # type: ignore[arg-type]
