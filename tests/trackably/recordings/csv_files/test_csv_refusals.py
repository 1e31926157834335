"""A CSV file is read, or refused in one sentence that names file and line."""

import gzip

import pytest

from tests.trackably.recordings.csv_files.files import COMMAS, read
from trackably.errors import InputError
from trackably.recordings import CsvLayout, DateTimes

RESTART = "t,x\n7,0\n7.1,1\n7.2,2\n0,3\n0.1,4\n"
REFUSALS = {
    "empty": ("", {}, ": expected a header that names the columns, got an empty file"),
    "no such column": (
        "t;a,b;y\n0;1;2\n",
        {},
        ": there is no column 'x'; with the separator ';' there are 't', 'a,b', ",
    ),
    "a title above the header": (
        "Device 7\nnext\nt;y\n0;1\n",
        {},
        ": there is no column 't'; with the separator ' ' there are 'Device', '7': if line 3 is the header, `skip` of",
    ),
    "text": (
        "# a comment\nt,x\n0,1\n\n1,one\n",
        {},
        ", line 5, column 'x': expected a finite number, got 'one'; if it stands for no value",
    ),
    "decimal commas unsaid": (
        "t;x\n0;1,5\n",
        {},
        ", line 2, column 'x': expected a finite number, got '1,5' (with layout=CsvLayout(decimal=\",\")",
    ),
    "dates unsaid": (
        "t,x\n2024-05-01T12:00:00.25Z,1\n",
        {},
        ", line 2, column 't': expected a finite number, got '2024-05-01T12:00:00.25Z' (dates have",
    ),
    "decimal commas without quotes": (
        "t,x\n0,1,5\n",
        {"layout": COMMAS},
        ", line 2: expected 2 cells, as in the header",
    ),
    "missing time": (
        "t,x\n0,1\n,2\n",
        {},
        ", line 3: the row has no time (drop_rows_without_time leaves such rows out)",
    ),
    "Latin-1 as UTF-8": ("t,x,größe\n0,1,2\n".encode("latin-1"), {}, ": it is not written in 'utf-8' ("),
    "binary": (b"\x7fELF\n\xff\0\1", {}, ", line 2: a NUL byte, so this is no text file"),
    "Parquet": (b"PAR1\0", {}, ": this is a Parquet file: read_parquet reads it"),
    "out of order": (
        "t,x\n0,0\n12.70,1\n0.0256,2\n0.03,3\n12.8,4\n",
        {},
        ", line 4: times must not decrease, got 0.0256 s after 12.7 s; 1 row is out of order ",
    ),
    "out of order, late": (
        "t,x\n0,0\n3,1\n4,2\n1,3\n2,4\n5,5\n",
        {},
        ", line 5: times must not decrease, got 1 s after 4 s; 2 rows are out of order ",
    ),
    "a clock that starts again": (
        RESTART,
        {},
        ", line 5: times must not decrease, got 0 s after 7.2 s; at line 5 the clock seems to start again, ",
    ),
    "the end of summer time": (
        "t,x\n27.10.2024 02:10,0\n27.10.2024 02:50,1\n27.10.2024 02:00,2\n27.10.2024 02:10,3\n",
        {"unit": DateTimes("%d.%m.%Y %H:%M")},
        ", line 4: times must not decrease, got 27.10.2024 02:00 after 27.10.2024 02:50; at line 4 the clock is set",
    ),
    "midnight": (
        "t,x\n23:59:58,0\n23:59:59,1\n00:00:00,2\n00:00:01,3\n",
        {"unit": DateTimes("%H:%M:%S")},
        ", line 4: times must not decrease, got 00:00:00 after 23:59:59; at line 4 times of day begin again at mid",
    ),
    "repeated": (
        "t,x\n0,9\n1,1\n1,2\n1,6\n2,8\n",
        {},
        ", line 4: 'x' has a second value at 1 s, the first is in line 3; 2 rows are repeated ",
    ),
    "no value at all": ("t,x\n0,\n1,\n", {}, ": 'x' has no value in any of the 2 rows that were not left out"),
    "closer than a float64 can tell": (
        "t,x\n1,1\n1.00000000000000000001,2\n",
        {},
        ", line 3: this time and that of line 2 are one and the same float64",
    ),
    "no float64": ("t,x\n0,1\n1e400,2\n", {}, ", line 3: expected a time that fits a float64, got 1E+400 s"),
}


@pytest.mark.parametrize("name", REFUSALS)
def test_refused(tmp_path, name):
    path, (text, options, message) = tmp_path / "some.csv", REFUSALS[name]
    with pytest.raises(InputError) as caught:
        read(path, text, **options)
    assert str(caught.value).startswith(f"{path}{message}")


@pytest.mark.parametrize("cell", ["1 000", "1_000", "-Infinity", "0x10", "1e", "1.2.3", "٣", "1e99999"])
@pytest.mark.parametrize("layout", [CsvLayout(), COMMAS])
def test_only_a_number_is_taken_for_one(tmp_path, cell, layout):
    with pytest.raises(InputError, match=f"line 2, column 'x': expected a finite number, got '{cell}'"):
        read(tmp_path / "some.csv", f"t;x\n0;{cell}\n", layout=layout)


def test_gzip_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"some\.csv\.gz: this is a gzip file: unpack it"):
        read(tmp_path / "some.csv.gz", gzip.compress(b"t,x\n0,1\n1,2\n"))
