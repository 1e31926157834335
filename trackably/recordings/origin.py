"""The origin from which the times of a recording are counted."""

from datetime import datetime, timedelta
from decimal import ROUND_FLOOR, Decimal
from typing import Literal

import numpy as np

from trackably.errors import InputError
from trackably.recordings.decimals import EXACT, NANOSECOND, plain

Origin = int | Literal["first"] | None
"""The time zero [ns] on the file's own clock; or the first sample of all signals; or None: the clock's default."""

_EPOCH = datetime(1970, 1, 1)


def checked_origin(origin: object) -> Origin:
    """Return the origin as given, a NumPy integer as int. InputError: anything else."""
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


def zero_of(origin: Origin, absolute: bool, first: Decimal) -> int:
    """Return the origin [ns], where the stamp [s] of the first sample is `first`: that time, rounded down, or its own.

    None is "first" if the stamps are `absolute`, otherwise the file's own zero.
    """
    if origin is None:
        origin = "first" if absolute else 0
    if origin != "first":
        return origin
    return int(EXACT.divide(first, NANOSECOND).to_integral_value(ROUND_FLOOR))


def described(origin: int, absolute: bool) -> str:
    """Format an `origin` [ns] for people: as a date if it is `absolute` (counts from 1970), otherwise in seconds."""
    if not absolute:
        return f"{plain(EXACT.multiply(Decimal(origin), NANOSECOND))} s on the file's own clock"
    seconds, nanoseconds = divmod(origin, 10**9)
    since = f"{origin} ns since 1970"
    try:
        date = (_EPOCH + timedelta(seconds=seconds)).isoformat(" ")
    except OverflowError:  # beyond the calendar: as when stamps in ms are read as s
        return since
    fraction = f".{nanoseconds:09d}".rstrip("0").rstrip(".")
    return f"{date}{fraction} UTC ({since})"
