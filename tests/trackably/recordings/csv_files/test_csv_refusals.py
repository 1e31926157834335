"""A CSV file is read, or refused in one sentence that names file and line."""

from pathlib import Path
from typing import Any

import pytest

from tests.trackably.recordings.csv_files.files import COMMAS, X, read
from trackably.errors import InputError
from trackably.recordings import CsvLayout, read_csv


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "some.csv"


SKIP = "; if the line holds units or notes, name its number in `skip`"
MISSING = (
    "; if it stands for no value, name it in `missing` of the layout beside '', '-', 'na', 'n/a', 'nan', 'null'" + SKIP
)
FORMATS = ' (DateTimes("%d.%m.%Y %H:%M:%S") as time unit reads other formats)'

REFUSALS: dict[str, tuple[str | bytes, dict[str, Any], str]] = {
    "empty": ("", {}, ": expected a header that names the columns, got an empty file"),
    "no rows": ("t,x\n", {}, ": there are no rows below the header"),
    "no such column": (
        "t;a,b;y\n0;1;2\n",
        {},
        ": there is no column 'x'; with the separator ';' there are 't', 'a,b', 'y'",
    ),
    "wrong separator behind a quote": (
        '"t";"x"\n0;1\n',
        {"layout": CsvLayout(separator=",")},
        ", line 1: no CSV with the separator ',' (',' expected after '\"')",
    ),
    "two columns of a name": ("t,x,x\n0,1,2\n", {}, ": expected one column 'x', got 2"),
    "text": ("t,x\n0,1\n\n1,one\n", {}, f", line 4, column 'x': expected a number, got 'one'{MISSING}"),
    "decimal commas unsaid": (
        "t;x\n0;1,5\n",
        {},
        ", line 2, column 'x': expected a number, got '1,5' (with layout=CsvLayout(decimal=\",\") it would be one)",
    ),
    "dates unsaid": (
        "t,x\n2024-05-01T12:00:00.25Z,1\n",
        {},
        ", line 2, column 't': expected a number, got '2024-05-01T12:00:00.25Z' "
        '(times of this form have the unit "ISO 8601")',
    ),
    "too large": (
        "t,x\n0,1e400\n",
        {},
        ", line 2, column 'x': expected a number that fits a float64, got 1.000e+400 (times 1.0)",
    ),
    "numbers where dates were said": (
        "t,x\n17,1\n",
        {"unit": "ISO 8601"},
        f", line 2, column 't': expected a stamp like 2024-05-01T12:00:00.25Z, got '17'{FORMATS}",
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
    "binary": (
        b"\x7fELF\n\xff\0\1",
        {},
        ", line 2: a NUL byte, so this is no text file (unless the encoding 'utf-16-le' reads it)",
    ),
    "MCAP": (b"\x89MCAP0\r\n\1\0", {}, ": this is an MCAP file, which read_mcap reads"),
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
