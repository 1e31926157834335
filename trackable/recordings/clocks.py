"""What a stamp in a file means: ticks of some length, or a date and a time of day."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Context, Decimal

from trackable.errors import InputError
from trackable.recordings.dates import DateTimes
from trackable.recordings.decimals import EXACT


@dataclass(frozen=True)
class Ticks:
    """Stamps are numbers of ticks, each `length` [s] long, since some zero; `absolute` where that is 1970, UTC."""

    length: Decimal
    absolute: bool = False

    def __post_init__(self) -> None:
        if not (self.length.is_finite() and self.length > 0):
            raise InputError(f"clock: a tick must take some finite time, got {self.length} s")

    def seconds(self, stamp: Decimal) -> Decimal:
        """The time [s] since zero, exactly."""
        return EXACT.multiply(stamp, self.length)


Clock = Ticks | DateTimes

_LENGTHS = {"s": "1", "ms": "1e-3", "us": "1e-6", "µs": "1e-6", "ns": "1e-9", "min": "60", "h": "3600"}

CLOCKS: Mapping[str, Clock] = {
    **{unit: Ticks(Decimal(length)) for unit, length in _LENGTHS.items()},
    **{f"epoch {unit}": Ticks(Decimal(_LENGTHS[unit]), absolute=True) for unit in ("s", "ms", "us", "ns")},
    "ISO 8601": DateTimes(),
}
"""By name: units, whose zero is the file's own; units since the UNIX epoch, 1970; and dates."""


def frames(rate: float) -> Ticks:
    """Stamps that count frames or steps, `rate` [1/s] of them in a second. InputError where `rate` is not positive."""
    if not 0 < rate < math.inf:
        raise InputError(f"clock: expected some frames in a second, got {rate}")
    return Ticks(Context(prec=50).divide(Decimal(1), Decimal(repr(rate))))  # 50 digits: as good as exact for a float64


def clock_named(clock: str | Clock) -> Clock:
    """The clock of that name, or the clock itself. InputError lists the names."""
    if isinstance(clock, Ticks | DateTimes):
        return clock
    if clock not in CLOCKS:
        raise InputError(f"expected a time unit, one of {', '.join(CLOCKS)}, got {clock!r}")
    return CLOCKS[clock]
