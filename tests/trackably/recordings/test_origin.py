"""An origin is a number of nanoseconds, the first sample, or nothing; and is told so that people can read it."""

from typing import Any

import numpy as np
import pytest

from trackably.errors import InputError
from trackably.recordings.clocks import checked_origin, describe_origin

NS = 1772442900_090000000


@pytest.mark.parametrize("origin", [None, "first", 0, -5, NS])
def test_origins(origin: Any) -> None:
    assert checked_origin(origin) == origin


@pytest.mark.parametrize("origin", ["nonsense", "0", "First", "", 0.0, 1.5e9, float("nan"), np.float64(1), True, [0]])
def test_no_origin(origin: Any) -> None:
    with pytest.raises(InputError) as caught:
        checked_origin(origin)
    assert str(caught.value) == (
        f'origin: expected a whole number of nanoseconds, "first" (the first sample of all) or None, got {origin!r}'
    )


ABSOLUTE = {
    NS: "2026-03-02 09:15:00.09 UTC",
    1700000000_000000001: "2023-11-14 22:13:20.000000001 UTC",
    1700000000_000000000: "2023-11-14 22:13:20 UTC",
    0: "1970-01-01 00:00:00 UTC",
    -1: "1969-12-31 23:59:59.999999999 UTC",
}


@pytest.mark.parametrize("origin", ABSOLUTE)
def test_dates(origin: int) -> None:
    assert describe_origin(origin, absolute=True) == f"{ABSOLUTE[origin]} ({origin} ns since 1970)"


@pytest.mark.parametrize("origin", [10**30, -(10**30), 10**21])
def test_beyond_all_calendars(origin: int) -> None:
    assert describe_origin(origin, absolute=True) == f"{origin} ns since 1970"


@pytest.mark.parametrize(
    ("origin", "seconds"), [(0, "0"), (184_230_400_000, "184.2304"), (-1, "-0.000000001"), (10**40, "1" + "0" * 31)]
)
def test_seconds(origin: int, seconds: str) -> None:
    assert describe_origin(origin, absolute=False) == f"{seconds} s on the file's own clock"
