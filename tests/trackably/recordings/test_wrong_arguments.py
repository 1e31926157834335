"""What readers are asked for is checked before a file is read: one sentence names the argument and what came."""

import re
from decimal import Decimal
from functools import partial

import pytest

from trackably.errors import InputError
from trackably.recordings import CLOCKS, Column, Field, Signal, Ticks, read_csv, read_mcap
from trackably.recordings.clocks import doubt

csv = partial(read_csv, **{"path": "a.csv", "time": "t", "time_unit": "s", "signals": {"y": "y"}})
SIGNAL = Signal([0, 1], [1, 2])

WRONG = {
    "signals in a list": (lambda: csv(signals=["y"]), "signals: expected a mapping from names to columns, as {"),
    "a field alone": (
        lambda: read_mcap("a.mcap", Field("/t", "y")),
        "signals: expected a mapping from names to fields",
    ),
    "scale, text": (lambda: Column("y", "1e-3"), "'y': expected a number as scale, got '1e-3'"),
    "stamp as a text": (lambda: Field("/t", "y", time="header.stamp"), 'PUBLISH_TIME or Stamp("header.stamp"), got'),
    "unit number": (lambda: csv(time_unit=1e-3), "expected a time unit, one of s, ms"),
    "time number": (lambda: csv(time=0), "time: expected the name of a column, or None to count rows, got 0"),
    "layout": (lambda: csv(layout=";"), "layout: expected a CsvLayout, as CsvLayout(separator=';'), got ';'"),
    "no path to a file": (lambda: csv(path=None), "path: expected the path of a file, got None"),
    "an origin in seconds": (lambda: csv(origin=1.5e9), 'origin: expected a whole number of nanoseconds, "first"'),
    "spacing": (lambda: SIGNAL.every(None), "expected a time between samples above 0 s, got None s"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_arguments_are_named(name):
    call, sentence = WRONG[name]
    with pytest.raises(InputError, match=re.escape(sentence)):
        call()


NOW = 1714564800  # 2024-05-01
COUNTS = {"epoch s": NOW, "epoch ms": NOW * 10**3, "epoch us": NOW * 10**6, "epoch ns": NOW * 10**9}


@pytest.mark.parametrize("said", COUNTS)
@pytest.mark.parametrize("meant", COUNTS)
def test_stamps_since_1970_tell_their_unit(said, meant):
    clock = CLOCKS[said]
    assert isinstance(clock, Ticks)
    question = doubt(clock, clock.seconds(Decimal(COUNTS[meant])))
    wanted = f"the first stamp, {COUNTS[meant]}, is far from the present in this unit; is it '{meant}', of 2024?"
    assert question == (None if said == meant else f"time: {wanted}")
