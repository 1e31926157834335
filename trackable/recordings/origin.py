"""Where the times of a recording count from."""

from datetime import datetime, timedelta
from decimal import Decimal
from typing import Literal

import numpy as np

from trackable.errors import InputError
from trackable.recordings.decimals import EXACT, NANOSECOND, plain

Origin = int | Literal["first"] | None
"""The zero [ns] on the file's own clock; or the first sample of all; or None: what is usual for the clock."""

_EPOCH = datetime(1970, 1, 1)


def checked_origin(origin: object) -> Origin:
    """The origin as it was handed in. InputError says what is possible."""
    match origin:
        case None:
            return None
        case "first":
            return "first"
        case bool():
            pass
        case int() | np.integer():
            return int(origin)
    raise InputError(
        f'origin: expected a whole number of nanoseconds, "first" (the first sample of all) or None, got {origin!r}'
    )


def described(origin: int, absolute: bool) -> str:
    """The zero at `origin` [ns], for people: as a date where it counts from 1970, as `absolute` says, else in s."""
    if not absolute:
        return f"{plain(EXACT.multiply(Decimal(origin), NANOSECOND))} s on the file's own clock"
    seconds, nanoseconds = divmod(origin, 10**9)
    since = f"{origin} ns since 1970"
    try:
        date = (_EPOCH + timedelta(seconds=seconds)).isoformat(" ")
    except OverflowError:  # no calendar goes there: stamps in ms that are read as s do
        return since
    fraction = f".{nanoseconds:09d}".rstrip("0").rstrip(".")
    return f"{date}{fraction} UTC ({since})"
