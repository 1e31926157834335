"""Each repair changes the rows that it names and no others, and counts them."""

import pytest

from tests.trackably.recordings.csv_files.files import pairs, read
from tests.trackably.recordings.csv_files.test_csv_refusals import RESTART
from trackably.errors import DoubtfulInputWarning
from trackably.recordings import Finding

BOTH = {"x": "x", "y": "y"}


def test_chosen_repairs_are_done_and_reported(tmp_path):
    dirty = "t,x,y\n0,1,-1\n2,2,\n1,3,-3\n,4,-4\n2,5,-5\n5,,-6\n0,0,0\n"
    repairs = ["drop_zero_rows", "drop_rows_without_time", "sort_rows", "keep_first_of_repeated"]
    recording = read(tmp_path / "a.csv", dirty, signals=BOTH, repairs=repairs)
    assert pairs(recording, "x") == [(0, 1), (1, 3), (2, 2)]
    assert pairs(recording, "y") == [(0, -1), (1, -3), (2, -5), (5, -6)]
    (cleaning,) = recording.cleanings
    assert cleaning.rows == 7
    assert cleaning.findings == (
        Finding("no value of x", 1, "line 7"),
        Finding("no value of y", 1, "line 3"),
        Finding("zero in every signal, dropped", 1, "line 8"),
        Finding("no time, dropped", 1, "line 5"),
        Finding("out of order, sorted", 1, "line 4"),
        Finding("time repeated, first kept", 1, "line 6"),
    )


@pytest.mark.parametrize(
    ("repair", "kept", "word"),
    [
        ("keep_first_of_repeated", 1, "first kept"),
        ("keep_last_of_repeated", 6, "last kept"),
        ("average_repeated", 3, "averaged"),
    ],
)
def test_repeats_become_one(tmp_path, repair, kept, word):
    recording = read(tmp_path / "a.csv", "t,x,y\n0,9,9\n1,1,\n1,2,1\n1,6,\n2,8,8\n", signals=BOTH, repairs=[repair])
    assert pairs(recording, "x") == [(0, 9), (1, kept), (2, 8)]
    assert pairs(recording, "y") == [(0, 9), (1, 1), (2, 8)]
    assert recording.cleanings[0].findings[1:] == (Finding(f"time repeated, {word}", 2, "line 4"),)


def test_doubtful_clocks_are_asked_about(tmp_path):
    with pytest.warns(DoubtfulInputWarning, match="at line 5 the clock seems to start again"):
        read(tmp_path / "a.csv", RESTART, repairs=["sort_rows"])
    with pytest.warns(DoubtfulInputWarning, match="times begin in the year 56302: is their unit right"):
        read(tmp_path / "a.csv", "t,x\n1714564800000,0\n", unit="epoch s")
