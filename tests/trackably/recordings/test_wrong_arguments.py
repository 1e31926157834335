"""What readers are asked for is checked before a file is read: one sentence names the argument and what came."""

import re
from functools import partial

import pytest

from trackably.recordings import DateTimes, read_csv
from trackably.recordings.mcap_file import Field

csv = partial(read_csv, **{"path": "a.csv", "time": "t", "time_unit": "s", "signals": {"y": "y"}})
WRONG = {
    "signals in a list": (lambda: csv(signals=["y"]), "signals: expected by name a Column or the name of one, as {"),
    "scale of zero": (lambda: Field("/t", "y", 0.0), "'y': expected a scale other than zero, got 0.0"),
    "a part of a date": (
        lambda: DateTimes("%d.%m. %H:%M"),
        "clock: expected a format with day, month and year, or with",
    ),
    "stamp as a text": (lambda: Field("/t", "y", time="header.stamp"), 'or a Stamp, as Stamp("header.stamp"), got'),
    "layout": (lambda: csv(layout=";"), "layout: expected a CsvLayout, as CsvLayout(separator=';'), got ';'"),
    "an origin in seconds": (lambda: csv(origin=1.5e9), 'origin in nanoseconds (or None, or "first"): expected a'),
    "repair unknown": (lambda: csv(repairs=["sort"]), "there is no repair 'sort'; there are drop_rows_without_time,"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_arguments_are_named(name):
    call, sentence = WRONG[name]
    with pytest.raises((TypeError, ValueError), match=re.escape(sentence)):
        call()
