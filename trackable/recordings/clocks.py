"""Convert time stamps of a file to seconds: numbers of ticks, or dates with a time of day."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Context, Decimal

from trackable.errors import InputError
from trackable.recordings.dates import DateTimes
from trackable.recordings.decimals import EXACT


@dataclass(frozen=True)
class Ticks:
    """Stamps that count ticks of `length` [s] since some zero; `absolute` if that is 1970-01-01 00:00 UTC.

    InputError: a length that is not positive and finite.
    """

    length: Decimal
    absolute: bool = False

    def __post_init__(self) -> None:
        if not (self.length.is_finite() and self.length > 0):
            raise InputError(f"clock: a tick must take a positive finite time, got {self.length} s")

    def seconds(self, stamp: Decimal) -> Decimal:
        """Return the time [s] since zero, exactly."""
        return EXACT.multiply(stamp, self.length)


Clock = Ticks | DateTimes

_LENGTHS = {"s": "1", "ms": "1e-3", "us": "1e-6", "µs": "1e-6", "ns": "1e-9", "min": "60", "h": "3600"}

CLOCKS: Mapping[str, Clock] = {
    **{unit: Ticks(Decimal(length)) for unit, length in _LENGTHS.items()},
    **{f"epoch {unit}": Ticks(Decimal(_LENGTHS[unit]), absolute=True) for unit in ("s", "ms", "us", "ns")},
    "ISO 8601": DateTimes(),
}
"""The clocks by name: units with the file's own zero, units since the UNIX epoch (1970, UTC), and ISO 8601 dates."""


def frames(rate: float) -> Ticks:
    """Return the clock of stamps that count frames or steps, `rate` [1/s] of them each second.

    InputError: a rate that is not positive and finite.
    """
    if not 0 < rate < math.inf:
        raise InputError(f"clock: expected a positive finite number of frames per second, got {rate}")
    return Ticks(Context(prec=50).divide(Decimal(1), Decimal(repr(rate))))  # 50 digits: far more than a float64 has


def clock_named(clock: str | Clock) -> Clock:
    """Return the clock of that name in `CLOCKS`, or a clock as it is. InputError lists the names."""
    if isinstance(clock, Ticks | DateTimes):
        return clock
    if clock not in CLOCKS:
        raise InputError(f"expected a time unit, one of {', '.join(CLOCKS)}, got {clock!r}")
    return CLOCKS[clock]
