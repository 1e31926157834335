"""Convert time stamps of a file to seconds: numbers of ticks, or dates with a time of day."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from decimal import Context, Decimal

from trackably.arguments import is_number
from trackably.errors import InputError
from trackably.recordings.dates import DateTimes
from trackably.recordings.decimals import EXACT


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

_SINCE, _UNTIL = Decimal(946684800), Decimal(4102444800)  # the years 2000 and 2100, in seconds since 1970
_YEAR = Decimal("31556952")
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
    if not (is_number(rate) and 0 < rate < math.inf):
        raise InputError(f"clock: expected a positive finite number of frames per second, got {rate!r}")
    return Ticks(
        Context(prec=50).divide(Decimal(1), Decimal(repr(float(rate))))
    )  # 50 digits: far more than a float64 has


def doubt(clock: Clock, first: Decimal) -> str | None:
    """Return a question if the `first` time [s] of a clock is hardly what was meant; None otherwise.

    Stamps since 1970 lie between 2000 and 2100 in one unit only; so they tell their unit.
    """
    if not isinstance(clock, Ticks) or (clock.absolute and _is_likely(first)):
        return None
    count = Context(prec=50).divide(first, clock.length)
    units = {name: other for name, other in CLOCKS.items() if isinstance(other, Ticks) and other.absolute}
    likely = [name for name, other in units.items() if _is_likely(other.seconds(count))]
    if not likely or (not clock.absolute and units[likely[0]].length != clock.length):
        return None
    unit = likely[0]
    year = 1970 + int(units[unit].seconds(count) / _YEAR)
    if clock.absolute:
        return f"time: the first stamp, {count:f}, is far from the present in this unit; is it {unit!r}, of {year}?"
    return (
        f'time: the first stamp, {count:f}, looks like {unit!r} of {year}; with that unit, or with origin="first", '
        "times count from the first sample"
    )


def first_doubt(clock: Clock, stamps: Sequence[Decimal | None]) -> str | None:
    """Return the `doubt` of the first time [s] that there is."""
    first = next((stamp for stamp in stamps if stamp is not None), None)
    return None if first is None else doubt(clock, first)


def _is_likely(seconds: Decimal) -> bool:
    return _SINCE <= seconds < _UNTIL


def clock_named(clock: object) -> Clock:
    """Return the clock of that name in `CLOCKS`, or a clock as it is. InputError lists the names."""
    if isinstance(clock, Ticks | DateTimes):
        return clock
    if not isinstance(clock, str) or clock not in CLOCKS:
        raise InputError(f"expected a time unit, one of {', '.join(CLOCKS)}, got {clock!r}")
    return CLOCKS[clock]
