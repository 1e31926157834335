"""Each repair changes the rows that it names and no others, and counts them."""

import pytest

from tests.trackably.recordings.tables import NAN, REPEATED, content, findings, record, rows
from trackably.recordings import (
    Finding,
    average_repeated,
    drop_rows_without_time,
    drop_zero_rows,
    keep_first_of_repeated,
    keep_last_of_repeated,
    sort_rows,
)

DIRTY = rows(
    ["0", "2", "1", None, "2", "5", "0"],
    x=[1.0, 2.0, 3.0, 4.0, 5.0, NAN, 0.0],
    y=[-1.0, NAN, -3.0, -4.0, -5.0, -6.0, 0.0],
)


def test_chosen_repairs_are_done_and_reported():
    recording = record(DIRTY, drop_zero_rows, drop_rows_without_time, sort_rows, keep_first_of_repeated)
    assert content(recording) == {
        "x": [(0.0, 1.0), (1.0, 3.0), (2.0, 2.0)],
        "y": [(0.0, -1.0), (1.0, -3.0), (2.0, -5.0), (5.0, -6.0)],
    }
    assert recording.cleanings[0].rows == 7
    assert findings(recording) == (
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
        (keep_first_of_repeated, 1.0, "first kept"),
        (keep_last_of_repeated, 6.0, "last kept"),
        (average_repeated, 3.0, "averaged"),
    ],
)
def test_repeats(repair, kept, word):
    recording = record(REPEATED, repair)
    assert content(recording) == {
        "x": [(0.0, 9.0), (1.0, kept), (2.0, 8.0)],
        "y": [(0.0, 9.0), (1.0, 1.0), (2.0, 8.0)],
    }
    assert findings(recording)[1:] == (Finding(f"time repeated, {word}", 2, "line 4"),)


def test_an_average_has_the_noise_of_an_average():
    recording = record(rows(["0", "1", "1"], noise=[1.0, 3.0, 4.0], x=[0.0, 1.0, 2.0]), average_repeated)
    assert recording["x"].relative_noise.tolist() == [1.0, 2.5]
