"""A number keeps every digit, and a date its microseconds, in whichever unit, format and zone it stands."""

import re
from datetime import datetime, timedelta
from decimal import Decimal
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from trackably import InputError, read_csv
from trackably.recordings import CLOCKS, DateTimes, frames

DATES = {
    "1970-01-01T00:00:00Z": "0",
    "1969-12-31T23:59:59.25Z": "-0.75",
    "2023-11-14T22:13:20.123456789Z": "1700000000.123456",
    "2023-11-14T23:13:20.5+01:00": "1700000000.5",
    "20231114T221320Z": "1700000000",
    "2023-11-14": "1699920000",
    "2023-11-14 22:13:20,5 -00:30": "1700001800.5",
    "2023-11-14 22:13:20 UTC": "1700000000",
}

NO_DATES = [
    *("", "17", "2024-5-1", "2023-02-29", "01.05.2024 12:00:00", "2024-05-01T25:00:00Z"),
    *("2024-05-01T12:30.5Z", "2024-05-01.5", "2024-05-01_12:00:00.5", "1712121211200", "2024-05 -01"),
]

OTHERS = [
    (DateTimes(" %d.%m.%Y %H:%M:%S"), "14.11.2023 22:13:20.5", "1700000000.5"),
    (DateTimes("%d.%m.%Y %H:%M:%S,%f"), "14.11.2023 22:13:20", "1700000000"),
    (DateTimes("%d.%m.%Y %H:%M:%S %z", "+05:00"), "14.11.2023 23:13:20 +0100", "1700000000"),
    (DateTimes("%d.%m.%Y %H:%M:%S.%f %z"), "14.11.2023 23:13:20.250001 +0100", "1700000000.250001"),
    (DateTimes("%m/%d/%y %I:%M:%S %p"), "11/14/23 10:13:20 PM", "1700000000"),
    (DateTimes("%d.%m.%Y", "+01:00"), "14.11.2023", "1699916400"),
    (DateTimes(zone="+01:00"), "2023-11-14T23:13:20.5", "1700000000.5"),
    (DateTimes("%H:%M:%S,%f", "+01:00"), "12:00:00,1234", "43200.1234"),
    (DateTimes("%I:%M %p"), "01:30 PM", "48600"),
    (CLOCKS["h"], "0,5", "1800"),
    (CLOCKS["min"], "0,5", "30"),
    (CLOCKS["µs"], "1700000000,000000001", "1700.000000000000001"),
    (frames(8), "3", "0.375"),
]


@pytest.mark.parametrize("text", DATES)
def test_dates(text):
    assert DateTimes().seconds(text) == Decimal(DATES[text])


@pytest.mark.parametrize("text", NO_DATES)
def test_no_dates(text):
    with pytest.raises(ValueError, match=re.escape(f"expected a stamp like 2024-05-01T12:00:00.25Z, got {text!r}")):
        DateTimes().seconds(text)


@pytest.mark.parametrize(("clock", "text", "seconds"), OTHERS)
def test_other_clocks(clock, text, seconds):
    assert clock.seconds(text, ",") == Decimal(seconds)
    assert clock.absolute == (Decimal(seconds) > 1e9)


@given(
    st.datetimes(datetime(1900, 1, 1), datetime(2100, 1, 1)),
    st.integers(-14 * 60, 14 * 60),
    st.sampled_from(["%d.%m.%Y %H:%M:%S,%f", "%d.%m.%Y %H.%M.%S.%f", "%d,%m,%Y,%H,%M,%S,%f", "%Y%m%d%H%M%S%f"]),
)
def test_a_format_reads_what_it_wrote(moment, minutes, form):
    zone = f"{'-' if minutes < 0 else '+'}{abs(minutes) // 60:02d}:{abs(minutes) % 60:02d}"
    utc = moment - timedelta(minutes=minutes)
    expected = Fraction((utc - datetime(1970, 1, 1)) // timedelta(microseconds=1), 10**6)
    assert Fraction(DateTimes(form, zone).seconds(moment.strftime(form))) == expected


def test_a_date_and_a_time_of_day_in_two_columns_are_one_stamp(tmp_path):
    path = tmp_path / "two.csv"
    path.write_text("Date,Time,x\n14.11.2023,23:59:59.5,0\n15.11.2023,00:00:00.25,1\n15.11.2023,,2\n")
    unit = DateTimes("%d.%m.%Y %H:%M:%S.%f")
    found = read_csv(path, ("Date", "Time"), unit, {"x": "x"}, repairs=["drop_rows_without_time"])
    assert found["x"].times.tolist() == [0.0, 0.75]
    assert "no time zone, taken as UTC: 2, first in line 2" in str(found)
    with pytest.raises(
        InputError, match=r"line 2, column 'Date, Time': expected a stamp like .*, got '14.11.2023 23:5"
    ):
        read_csv(path, ("Date", "Time"), "ISO 8601", {"x": "x"})
    with pytest.raises(InputError, match=r'time=\("Date", "Time"\) joins a date and a time of day from two columns'):
        read_csv(path, "Time", "ISO 8601", {"x": "x"})
