"""What was written in a CSV file comes back, however it was written; what is no sample is refused where it stands."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from trackable.errors import InputError
from trackable.files import unreadable
from trackable.recordings import Column, CsvLayout, DateTimes, Finding, Recording, frames, read_csv, sort_rows

X = {"x": Column("x")}
COMMAS = CsvLayout(decimal=",")
FLOATS = st.floats(allow_nan=False, allow_infinity=False)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "some.csv"


def read(path: Path, text: str | bytes, unit: Any = "s", **options: Any) -> Recording:
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_csv(path, "t", unit, options.pop("signals", X), **options)


def pairs(recording: Recording, name: str = "x") -> list[tuple[float, float]]:
    return list(zip(recording[name].times.tolist(), recording[name].values.tolist(), strict=True))


EXPECTED = [(0.0, 1.5), (0.1, -2.0), (0.25, 3e-7)]

WRITTEN: dict[str, tuple[str | bytes, CsvLayout]] = {
    "comma": ("t,x\n0,1.5\n0.1,-2\n0.25,3e-7\n", CsvLayout()),
    "semicolon": ("t;x\n0;1.5\n0.1;-2\n0.25;3e-7\n", CsvLayout()),
    "tab": ("t\tx\n0\t1.5\n0.1\t-2\n0.25\t3e-7\n", CsvLayout()),
    "given separator": ("t|x\n0|1.5\n0.1|-2\n0.25|3e-7\n", CsvLayout(separator="|")),
    "decimal commas": ("t;x\n0;1,5\n0,1;-2\n0,25;3e-7\n", COMMAS),
    "quoted decimal commas": ('"t","x"\n"0","1,5"\n"0,1","-2"\n"0,25","3e-7"\n', COMMAS),
    "quoted names": ('"t";"x"\n0;1,5\n0,1;-2\n0,25;3e-7\n', COMMAS),
    "other columns": ("a,x,b,t\n?,1.5,,0\n,-2,text,0.1\n,3e-7,,0.25\n", CsvLayout()),
    "a name with a separator in quotes": ('"a;b",t,x\n1,0,1.5\n1,0.1,-2\n1,0.25,3e-7\n', CsvLayout()),
    "a name with a line break in quotes": ('"a\nb",t,x\n1,0,1.5\n1,0.1,-2\n1,0.25,3e-7\n', CsvLayout()),
    "spaces": (' t ; "x"\n 0 ; 1.5 \n0.1;  -2\n0.25; "3e-7"\n', CsvLayout()),
    "carriage returns": ("t,x\r\n0,1.5\r\n0.1,-2\r\n0.25,3e-7\r\n", CsvLayout()),
    "carriage returns alone": ("t,x\r0,1.5\r0.1,-2\r0.25,3e-7", CsvLayout()),
    "no last line break": ("t,x\n0,1.5\n0.1,-2\n0.25,3e-7", CsvLayout()),
    "blank lines": ("\nt,x\n\n0,1.5\n  \n0.1,-2\n0.25,3e-7\n\n\n", CsvLayout()),
    "separator at the end": ("t,x,\n0,1.5,\n0.1,-2,\n0.25,3e-7,\n", CsvLayout()),
    "separator at the end of rows": ("t,x\n0,1.5,\n0.1,-2,\n0.25,3e-7,\n", CsvLayout()),
    "comments": ("# a; b; c\nt,x\n0,1.5\n#0.05,7\n0.1,-2\n0.25,3e-7\n", CsvLayout()),
    "other comments": ("% a\nt,x\n0,1.5\n0.1,-2\n0.25,3e-7\n", CsvLayout(comment="%")),
    "lines to skip": ("Device,7\n\nt,x\n[s],[mm]\n0,1.5\n0.1,-2\n0.25,3e-7\n", CsvLayout(skip=(1, 4))),
    "mark of UTF-8": (b"\xef\xbb\xbft,x\n0,1.5\n0.1,-2\n0.25,3e-7\n", CsvLayout()),
    "mark of UTF-8, said": (b"\xef\xbb\xbft,x\n0,1.5\n0.1,-2\n0.25,3e-7\n", CsvLayout(encoding="UTF-8-SIG")),
    "UTF-8": ("t,x,größe\n0,1.5,µ\n0.1,-2,µ\n0.25,3e-7,µ\n", CsvLayout()),
    "Latin-1": ("t,x,größe\n0,1.5,µ\n0.1,-2,µ\n0.25,3e-7,µ\n".encode("latin-1"), CsvLayout(encoding="latin-1")),
    "UTF-16": ("t,x\n0,1.5\n0.1,-2\n0.25,3e-7\n".encode("utf-16"), CsvLayout(encoding="utf-16")),
}


@pytest.mark.parametrize("name", WRITTEN)
def test_layouts(path: Path, name: str) -> None:
    text, layout = WRITTEN[name]
    recording = read(path, text, layout=layout)
    assert pairs(recording) == EXPECTED
    assert (recording.origin, recording.cleanings[0].findings, recording.cleanings[0].rows) == (0, (), 3)


def test_a_name_with_a_comment_sign_can_be_had(path: Path) -> None:
    text = "#t,x\n0,1\n"
    path.write_text(text)
    assert pairs(read_csv(path, "#t", "s", X, CsvLayout(comment=""))) == [(0.0, 1.0)]


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    values=st.lists(FLOATS, min_size=1, max_size=20),
    steps=st.lists(st.floats(1e-3, 1e3), min_size=20, max_size=20),
    layout=st.sampled_from([(";", ","), ("\t", ","), (",", "."), (";", "."), (",", ",")]),
    unit=st.sampled_from([("s", 0), ("ms", 3), ("ns", 9)]),
)
def test_round_trip(
    path: Path, values: list[float], steps: list[float], layout: tuple[str, str], unit: tuple[str, int]
) -> None:
    separator, mark = layout
    times = np.cumsum(steps[: len(values)]).tolist()
    # A tick of another length moves the point, and loses nothing: 0.1 s are 0.1e3 ms.
    rows = [(f"{t!r}e{unit[1]}", repr(x)) for t, x in zip(times, values, strict=True)]
    text = "\n".join(separator.join(f'"{cell.replace(".", mark)}"' for cell in row) for row in [("t", "x"), *rows])
    recording = read(path, text, unit[0], layout=CsvLayout(decimal=mark))
    assert recording["x"].times.tobytes() == np.array(times).tobytes()
    assert recording["x"].values.tobytes() == np.array(values).tobytes()


def test_units_and_scales(path: Path) -> None:
    signals = {"z": Column("x", 1e-3, noise_std="s"), "minus": Column("x", -2, noise_std="s")}
    recording = read(path, "t;x;s\n0;64,1;0,3\n100;-0,7;0,1\n", "ms", signals=signals, layout=COMMAS)
    assert pairs(recording, "z") == [(0.0, 0.0641), (0.1, -0.0007)]
    assert pairs(recording, "minus") == [(0.0, -128.2), (0.1, 1.4)]
    for name, noise_std in {"z": [0.0003, 0.0001], "minus": [0.6, 0.2]}.items():
        found = recording[name].noise_std
        assert found is not None
        assert found.tolist() == noise_std


def test_frames_as_stamps(path: Path) -> None:
    assert pairs(read(path, "t,x\n0,1\n768,2\n", frames(60))) == [(0.0, 1.0), (12.8, 2.0)]


STAMPED: dict[str, tuple[str, str]] = {
    "ISO 8601": ("ISO 8601", "2023-11-14T22:13:20.000000001Z 2023-11-14T23:13:20.1+01:00"),
    "epoch s": ("epoch s", "1700000000.000000001 1700000000.1"),
    "epoch ms": ("epoch ms", "1700000000000.000001 1700000000100"),
    "epoch us": ("epoch us", "1700000000000000.001 1700000000100000"),
    "epoch ns": ("epoch ns", "1700000000000000001 1700000000100000000"),
}


@pytest.mark.parametrize("name", STAMPED)
def test_stamps_since_1970(path: Path, name: str) -> None:
    unit, stamps = STAMPED[name]
    first, second = stamps.split()
    recording = read(path, f"t,x\n{first},1\n{second},2\n", unit)
    assert recording.origin == 1700000000_000000001
    assert pairs(recording) == [(0.0, 1.0), (0.099999999, 2.0)]
    again = read(path, f"t,x\n{first},1\n{second},2\n", unit, origin=1700000000_000000000)
    assert pairs(again) == [(1e-9, 1.0), (0.1, 2.0)]


@pytest.mark.parametrize("cell", ["", " ", "NaN", "nan", "NA", "n/a", "-", "null", '""'])
def test_missing_values(path: Path, cell: str) -> None:
    signals = {"x": Column("x"), "y": Column("y")}
    recording = read(path, f"t,x,y\n0,1,{cell}\n1,{cell},2\n2,{cell},3\n3,4,5", signals=signals)
    assert pairs(recording, "x") == [(0.0, 1.0), (3.0, 4.0)]
    assert pairs(recording, "y") == [(1.0, 2.0), (2.0, 3.0), (3.0, 5.0)]
    assert recording.cleanings[0].findings == (
        Finding("no value of x", 2, "line 3"),
        Finding("no value of y", 1, "line 2"),
    )


def test_what_is_missing_can_be_said(path: Path) -> None:
    recording = read(path, "t,x\n0,1\n1,-9999\n2,LOST\n", layout=CsvLayout(missing=("-9999", "lost")))
    assert pairs(recording) == [(0.0, 1.0)]


MISSING = "; if it stands for no value, name it in CsvLayout(missing=...) beside '', '-', 'na', 'n/a', 'nan', 'null'"
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
        "name it in CsvLayout(missing=...) beside 'LOST', ''",
    ),
    "text, nothing being missing": (
        "t,x\n0,-\n",
        {"layout": CsvLayout(missing=())},
        ", line 2, column 'x': expected a number, got '-'; if it stands for no value, "
        "name it in CsvLayout(missing=...) beside nothing",
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
        'does CsvLayout(encoding="latin-1") read it?',
    ),
    "UTF-16 as UTF-8": (
        "t,x\n0,1\n".encode("utf-16"),
        {},
        ': it begins with the mark of UTF-16, which CsvLayout(encoding="utf-16") reads',
    ),
    "UTF-16 without a mark": (
        "t,x\n0,1\n".encode("utf-16-le"),
        {},
        ', line 1: a NUL byte, so this is no text file (unless it is in UTF-16: CsvLayout(encoding="utf-16-le"))',
    ),
    "UTF-16 cut off": (
        "t,x\n0,1\n".encode("utf-16")[:-1],
        {"layout": CsvLayout(encoding="utf-16")},
        ": it is not written in 'utf-16' ('utf-16-le' codec can't decode byte 0x0a in position 16: truncated data)",
    ),
    "zeros behind the text": (
        b"t,x\r\n0,1\r\n1,\0\0\0",
        {},
        ', line 3: a NUL byte, so this is no text file (unless it is in UTF-16: CsvLayout(encoding="utf-16-le"))',
    ),
    "binary": (
        b"\x7fELF\n\xff\0\1",
        {},
        ', line 2: a NUL byte, so this is no text file (unless it is in UTF-16: CsvLayout(encoding="utf-16-le"))',
    ),
    "binary as Latin-1": (
        b"\xff\0\1",
        {"layout": CsvLayout(encoding="latin-1")},
        ', line 1: a NUL byte, so this is no text file (unless it is in UTF-16: CsvLayout(encoding="utf-16-le"))',
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
        ({"missing": "LOST"}, "CSV layout: expected a list of texts that stand for no value, got 'LOST'"),
    ],
)
def test_no_layout(options: dict[str, str], message: str) -> None:
    with pytest.raises(InputError) as caught:
        CsvLayout(**options)  # type: ignore[arg-type]
    assert str(caught.value) == message


def test_a_text_is_the_column_of_that_name(path: Path) -> None:
    text = "t;Weg [mm];x\n0;1.5;2\n1;-2;3\n"
    recording = read(path, text, signals={"p": "Weg [mm]", "x": Column("x", scale=2)})
    assert pairs(recording, "p") == [(0.0, 1.5), (1.0, -2.0)]
    assert pairs(recording, "x") == [(0.0, 4.0), (1.0, 6.0)]


@pytest.mark.parametrize("wanted", [("x", 1e-3), None, 2])
def test_no_column(path: Path, wanted: object) -> None:
    with pytest.raises(InputError) as caught:
        read(path, "t,x\n0,1\n", signals={"p": wanted})
    assert str(caught.value) == f"signal 'p': expected a Column, or the name of one, got {wanted!r}"


def test_repairs_by_name(path: Path) -> None:
    text = "t,x\n1,1\n0,2\n0,3\n"
    by_name = read(path, text, repairs=("sort_rows", "keep_last_of_repeated"))
    assert pairs(by_name) == [(0.0, 3.0), (1.0, 1.0)]
    mixed = read(path, text, repairs=[sort_rows, "keep_last_of_repeated"])
    assert (pairs(mixed), mixed.cleanings) == (pairs(by_name), by_name.cleanings)


def test_what_is_chosen_is_checked_before_the_file_is_read(path: Path) -> None:
    for options, message in (
        ({"repairs": ["sort"]}, "there is no repair 'sort'; there are drop_rows_without_time, "),
        ({"origin": "nonsense"}, "origin: expected "),
    ):
        with pytest.raises(InputError, match=re.escape(message)):
            read_csv(path, "t", "s", X, **options)  # type: ignore[arg-type]


def test_times_from_the_first_sample_on(path: Path) -> None:
    signals = {"x": Column("x"), "y": Column("y")}
    text = "t,x,y\n184230.4,,1\n184330.4,2,\n184430.4,3,4\n"
    assert pairs(read(path, text, "ms"))[0] == (184.3304, 2.0)
    recording = read(path, text, "ms", signals=signals, origin="first")
    assert recording.origin == 184_230_400_000
    assert pairs(recording, "x") == [(0.1, 2.0), (0.2, 3.0)]
    assert pairs(recording, "y") == [(0.0, 1.0), (0.2, 4.0)]


def test_dates_in_a_format_of_ones_own(path: Path) -> None:
    text = "t;x\n14.11.2023 23:13:20,000000001;1,5\n14.11.2023 23:13:20,1;2\n"
    recording = read(path, text, DateTimes("%d.%m.%Y %H:%M:%S", "+01:00"), layout=COMMAS)
    assert recording.origin == 1700000000_000000001
    assert pairs(recording) == [(0.0, 1.5), (0.099999999, 2.0)]


def test_truncated_anywhere(path: Path) -> None:
    """A file that lost its end is refused, or gives the whole rows that stand in it."""
    text = 't;"x";y\n0;1,5;7\n0,1;-2;8\n0,25;3e-7;"9"\n'
    refused = []
    for end in range(len(text)):
        try:
            found = pairs(read(path, text[:end], layout=COMMAS))
        except InputError as error:
            refused.append(str(error))
        else:
            assert found == EXPECTED[: len(found)]
    assert len(refused) > 20
    assert all(message.startswith(str(path)) for message in refused)
