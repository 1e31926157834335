"""What readers are asked for is checked before a file is read: one sentence names the argument and what came."""

import re
from decimal import Decimal
from functools import partial

import pytest

from trackably.recordings import CLOCKS, DateTimes, read_csv
from trackably.recordings.clocks import doubt
from trackably.recordings.mcap_file import Field, read_mcap

csv = partial(read_csv, **{"path": "a.csv", "time": "t", "time_unit": "s", "signals": {"y": "y"}})
WRONG = {
    "signals in a list": (lambda: csv(signals=["y"]), "signals: expected by name a Column or the name of one, as {"),
    "a field alone": (lambda: read_mcap("a.mcap", Field("/t", "y")), "signals: expected by name a Field, as {"),
    "scale of zero": (lambda: Field("/t", "y", 0.0), "'y': expected a scale other than zero, got 0.0"),
    "zone of half a second": (lambda: DateTimes(zone=".5Z"), 'expected a zone like "Z" or "+01:00", got \'.5Z\''),
    "a part of a date": (
        lambda: DateTimes("%d.%m. %H:%M"),
        "clock: expected a format with day, month and year, or with",
    ),
    "no hour": (
        lambda: DateTimes("%d.%m.%Y %M:%S"),
        "clock: expected a format with day, month and year, or with hour and minute",
    ),
    "neither date nor time": (lambda: DateTimes("now"), "expected a format with day, month and year, or with hour"),
    "stamp as a text": (lambda: Field("/t", "y", time="header.stamp"), 'or a Stamp, as Stamp("header.stamp"), got'),
    "unit number": (lambda: csv(time_unit=1e-3), "expected a time unit, one of s, ms"),
    "counted dates": (
        lambda: csv(time=None, time_unit="ISO 8601"),
        "time: with None, the time is the row number, which is no date",
    ),
    "layout": (lambda: csv(layout=";"), "layout: expected a CsvLayout, as CsvLayout(separator=';'), got ';'"),
    "an origin in seconds": (lambda: csv(origin=1.5e9), 'origin in nanoseconds (or None, or "first"): expected a'),
    "repair unknown": (lambda: csv(repairs=["sort"]), "there is no repair 'sort'; there are drop_rows_without_time,"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_arguments_are_named(name):
    call, sentence = WRONG[name]
    with pytest.raises((TypeError, ValueError), match=re.escape(sentence)):
        call()


NOW = 1714564800  # 2024-05-01
COUNTS = {"epoch s": NOW, "epoch ms": NOW * 10**3, "epoch us": NOW * 10**6, "epoch ns": NOW * 10**9}


@pytest.mark.parametrize("said", COUNTS)
@pytest.mark.parametrize("meant", COUNTS)
def test_stamps_since_1970_tell_their_unit(said, meant):
    clock = CLOCKS[said]
    question = doubt(clock, clock.seconds(Decimal(COUNTS[meant])))
    wanted = f"the first stamp, {COUNTS[meant]}, is far from the present in this unit; is it '{meant}', of 2024?"
    assert question == (None if said == meant else f"time: {wanted}")


def test_a_count_from_another_zero_is_asked_about_only_if_it_is_too_large():
    """1.7e12 s are 54,000 years, but 1.7e12 ns may be half an hour since a start."""
    for unit, asks in (("s", True), ("ms", True), ("us", False), ("ns", False)):
        assert (doubt(CLOCKS[unit], CLOCKS[unit].seconds(Decimal(COUNTS["epoch ms"]))) is not None) == asks
