"""What was written in a CSV file is read back, in every layout, unit and time zone."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.trackably.recordings.csv_files.files import COMMAS, EXPECTED, pairs, read
from trackably.errors import InputError
from trackably.recordings import Column, CsvLayout, Finding

ONE = np.int64(10**9)  # an origin [ns] may be a whole number of NumPy
FLOATS = st.floats(allow_nan=False, allow_infinity=False)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "some.csv"


WRITTEN = {
    "comma": ("t,x\n0,1.5\n0.1,-2\n0.25,3e-7\n", CsvLayout()),
    "decimal commas": ("t;x\n0;1,5\n0,1;-2\n0,25;3e-7\n", COMMAS),
    "other columns": ("a,x,b,t\n?,1.5,,0\n,-2,text,0.1\n,3e-7,,0.25\n", CsvLayout()),
    "a name with a separator in quotes": ('"a;b;c;d",t,x\n1,0,1.5\n1,0.1,-2\n1,0.25,3e-7\n', CsvLayout()),
    "spaces": (' t ; "x"\n 0 ; 1.5 \n0.1;  -2\n0.25; "3e-7"\n', CsvLayout()),
    "blank lines": ("\nt,x\n\n0,1.5\n  \n0.1,-2\n0.25,3e-7\n\n\n", CsvLayout()),
    "separator at the end": ("t,x,\n0,1.5,\n0.1,-2,\n0.25,3e-7,\n", CsvLayout()),
    "comments": ("# a; b; c\nt,x\n0,1.5\n#0.05,7\n0.1,-2\n0.25,3e-7\n", CsvLayout()),
    "lines to skip": ("Device,7\n\nt,x\n[s],[mm]\n0,1.5\n0.1,-2\n0.25,3e-7\n", CsvLayout(skip=(1, 4))),
    "spaces between": ("t        x\n0 1.5 \n 0.1    -2\n0.25  3e-7\n", CsvLayout()),
    "empty rows at the end": ("t;x;\n0;1.5;\n0.1;-2;\n0.25;3e-7;\n;;\n; ;\n", CsvLayout()),
    "mark of UTF-8": (b"\xef\xbb\xbft,x\n0,1.5\n0.1,-2\n0.25,3e-7\n", CsvLayout(encoding="latin-1")),
    "mark of UTF-16": ("t,x\n0,1.5\n0.1,-2\n0.25,3e-7\n".encode("utf-16"), CsvLayout()),
    "mark of UTF-32": ("t,x\n0,1.5\n0.1,-2\n0.25,3e-7\n".encode("utf-32"), CsvLayout()),
    "Latin-1": ("t,x,größe\n0,1.5,µ\n0.1,-2,µ\n0.25,3e-7,µ\n".encode("latin-1"), CsvLayout(encoding="latin-1")),
}


@pytest.mark.parametrize("name", WRITTEN)
def test_layouts(path, name):
    text, layout = WRITTEN[name]
    recording = read(path, text, layout=layout)
    assert pairs(recording) == EXPECTED
    assert (recording.origin, recording.cleanings[0].findings, recording.cleanings[0].rows) == (0, (), 3)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    values=st.lists(FLOATS, min_size=1, max_size=20),
    steps=st.lists(st.floats(1e-3, 1e3), min_size=20, max_size=20),
    layout=st.sampled_from([(";", ","), ("\t", ","), (",", "."), (";", "."), (",", ",")]),
    unit=st.sampled_from([("s", 0), ("ms", 3), ("ns", 9)]),
    scale=st.sampled_from([("1", "0"), ("1e-3", "273.15"), ("0.1", "0"), ("-0.3", "-0.012")]),
)
def test_what_is_written_is_read_and_rounded_once(path, values, steps, layout, unit, scale):
    separator, mark = layout
    times = np.cumsum(steps[: len(values)]).tolist()
    # A tick of another length moves the point, and loses nothing: 0.1 s are 0.1e3 ms.
    rows = [(f"{t!r}e{unit[1]}", repr(x)) for t, x in zip(times, values, strict=True)]
    text = "\n".join(separator.join(f'"{cell.replace(".", mark)}"' for cell in row) for row in [("t", "x"), *rows])
    signals = {"x": Column("x", float(scale[0]), offset=float(scale[1]))}
    recording = read(path, text, unit[0], signals=signals, layout=CsvLayout(decimal=mark))
    assert recording["x"].times.tobytes() == np.array(times).tobytes()
    factor, offset = map(Fraction, scale)
    assert recording["x"].values.tolist() == [float(Fraction(repr(x)) * factor + offset) for x in values]


@pytest.mark.parametrize("cell", ["", " ", "NaN", "n/a", "-", "null", '""'])
def test_missing_values(path, cell):
    signals = {"x": Column("x"), "y": Column("y")}
    recording = read(path, f"t,x,y\n0,1,{cell}\n1,{cell},2\n2,{cell},3\n3,4,5", signals=signals)
    assert pairs(recording, "x") == [(0.0, 1.0), (3.0, 4.0)]
    assert pairs(recording, "y") == [(1.0, 2.0), (2.0, 3.0), (3.0, 5.0)]
    assert recording.cleanings[0].findings == (
        Finding("no value of x", 2, "line 3"),
        Finding("no value of y", 1, "line 2"),
    )


def test_a_column_may_have_no_name(path):
    """As pandas writes the column of an index."""
    recording = read(path, ",t,x\n0.5,0,1\n2,1,3\n", signals={"x": "x", "y": ""}, origin=ONE)
    assert recording["y"].values.tolist() == [0.5, 2.0]
    assert recording["x"].times.tolist() == [-1.0, 0.0]


def test_truncated_anywhere(path):
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
