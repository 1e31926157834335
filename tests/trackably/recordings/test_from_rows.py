"""What no repair was chosen for is refused with its place; times count from the origin, which is exact."""

import re
from decimal import Decimal

import numpy as np
import pytest

from tests.trackably.recordings.tables import NAN, REPEATED, record, rows
from trackably.errors import InputError
from trackably.recordings import Rows, average_repeated
from trackably.recordings.rows import recording_from_rows

GAPS = rows(["0", "1"], x=[1, 2], y=[NAN, NAN])
REFUSALS = {
    "out of order": (
        rows(["0", "12.70", "0.0256", "0.03", "12.8"], x=range(5)),
        "a.csv, line 4: times must not decrease, got 0.0256 s after 12.7 s; 1 row is out of order ",
    ),
    "repeated": (
        REPEATED,
        "a.csv, line 4: 'x' has a second value at 1 s, the first is in line 3; 2 rows are repeated ",
    ),
    "nothing to average": (GAPS, "a.csv: 'y' has no value in any of the 2 rows left", average_repeated),
    "noise of zero": (rows(["0", "1"], noise=[0.1, 0], x=[1, 2]), "a.csv, line 3: expected a positive standard dev"),
    "closer than a float64 can tell": (
        rows(["1", "1.00000000000000000001"], x=[1, 2]),
        "a.csv, line 3: this time and that of line 2 are one and the same float64",
    ),
    "no float64": (rows(["0", "1e400"], x=[1, 2]), "a.csv, line 3: expected a time that fits a float64, got 1E+400 s"),
}


@pytest.mark.parametrize("name", REFUSALS)
def test_refused(name):
    table, message, *repairs = REFUSALS[name]
    with pytest.raises(InputError, match=f"^{re.escape(message)}"):
        record(table, *repairs)


EPOCH = ["1700000000.000000001", "1700000000.100000001", "1700000000.300000002"]


def test_several_tables_have_one_origin():
    other = Rows("b", ["message 1"], [Decimal("1699999999")], {"y": np.array([7.0])})
    recording = recording_from_rows([rows(EPOCH, x=[1, 2, 3]), other], True, (), None)
    assert recording.origin == 1699999999_000000000
    assert recording["y"].times.tolist() == [0.0]
    assert recording["x"].times.tolist() == [1.000000001, 1.100000001, 1.300000002]
    assert [cleaning.source for cleaning in recording.cleanings] == ["a.csv", "b"]
