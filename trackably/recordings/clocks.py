"""Convert time stamps of a file (numbers of ticks, or dates with a time of day) to seconds since an origin."""

import math
import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, date, datetime, time, timedelta, tzinfo
from decimal import ROUND_FLOOR, Context, Decimal, Inexact, Overflow, Subnormal
from functools import cached_property, lru_cache
from typing import Literal

from trackably.arguments import positive, short

# Numbers as written in a file: kept exactly, and rounded to float64 once, at the end.
#
# Stamps since 1970 have more digits than a float64, and 64.1 mm becomes 0.0641 m only if the product is rounded once.

EXACT = Context(prec=1100)
"""Arithmetic with more digits than the difference or product of any two numbers that devices write."""

NANOSECOND = Decimal("1e-9")
POINT, COMMA = ".", ","
DECIMAL_MARKS = (POINT, COMMA)
_SWAPPED = str.maketrans(".,", ",.")

_BEGINS_AS_DATE = re.compile(r"\s*\d{1,4}([-/.:])\d\d?\1\d\d")  # a text that begins as a date or as a time of day
_BY_THOUSANDS = re.compile(r"[+-]?\d{1,3}(?:[.,]\d{3})+(?:[.,]\d*)?")
# float() would accept "1_000", "infinity" and digits of any script; an exponent of five digits is no measurement.
_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,4})?")
_LONGEST = 1000  # most digits, and limit of the decimal exponent: more than float64 needs, less than `EXACT` keeps
_READ = Context(prec=_LONGEST, Emin=1 - _LONGEST, Emax=_LONGEST - 1, traps=[Inexact, Overflow, Subnormal])


def exact(value: object, mark: str | None = None) -> Decimal:
    """Return a number of a file without rounding. ValueError: it is no finite number of at most 1000 digits.

    `mark` is the decimal mark of a number that is written as text; without a mark, texts are no numbers.
    """
    number, hint = value, ""
    if isinstance(value, str):
        text = value.strip().translate(_SWAPPED) if mark == COMMA else value.strip()
        number = text if mark and _NUMBER.fullmatch(text) else None
    try:
        if isinstance(number, str | int | float | Decimal) and not isinstance(number, bool):
            found = _READ.create_decimal(number)
            if found.is_finite():
                return found
        elif isinstance(value, str):
            hint = _what_it_may_be(value, text, mark)
    except (Inexact, Overflow, Subnormal):
        hint = f" of more than {_LONGEST} digits"
    raise ValueError(f"expected a finite number, got {short(value)}{hint}")


def _what_it_may_be(value: str, text: str, mark: str | None) -> str:
    """Return a hint at what a text that is no number means, or ""; `text` has points as decimal marks."""
    if _BEGINS_AS_DATE.match(value):
        return ' (dates have the unit "ISO 8601", or DateTimes(format) of trackably.recordings)'
    if mark is None:
        return " (a text: save it as a number)"
    if _NUMBER.fullmatch(text.translate(_SWAPPED)):
        other = POINT if mark == COMMA else COMMA
        return f' (with layout=CsvLayout(decimal="{other}"), or the option --decimal "{other}", it would be one)'
    if _BY_THOUSANDS.fullmatch(text):
        return " (marks between thousands are not read: write it without them)"
    return ""


def scale_once(number: Decimal, scale: float, offset: float = 0.0) -> float:
    """Return `number` times `scale` plus `offset`, both taken as their shortest decimals, rounded once.

    ValueError: the result is too large for float64.
    """
    product = number if scale == 1 else EXACT.multiply(number, _shortest(scale))
    result = float(EXACT.add(product, _shortest(offset)) if offset else product)
    if math.isinf(result):
        raise ValueError(f"expected a number that fits a float64, got {number:.3e} multiplied by {scale!r}")
    return result


@lru_cache
def _shortest(number: float) -> Decimal:
    return Decimal(repr(float(number)))


def plain(number: Decimal) -> str:
    """Format a number for a message: without exponent and trailing zeros, a float64 by its shortest decimals."""
    nearest = float(number)
    return f"{EXACT.normalize(_shortest(nearest) if nearest == number else number):f}"


_ISO = re.compile(r"\d{4}-?(\d\d-?\d\d|W\d\d(-?\d)?)([T ]\d\d(:?\d\d(:?\d\d([.,]\d+)?)?)?( ?[Z+-].*)?)?", re.ASCII)
"""Stamps for fromisoformat, which accepts any character between date and time, too, and fractions of a minute."""
_SPACE, _FRACTION = re.compile(" (?=[Z+-])"), re.compile("%S[.,]%f")  # before a zone; in a format
_EPOCH_UTC = datetime(1970, 1, 1, tzinfo=UTC)
_MICROSECOND, _MICRO = timedelta(microseconds=1), Decimal("1e-6")
_EXAMPLE = datetime(2024, 5, 1, 13, tzinfo=UTC)
_DAY, _NO_DAY = date(2024, 5, 17), date(1900, 1, 1)  # strptime takes the second one for a date that a format leaves out
# What formats keep of the time 13:07:09: nothing, the hour, hour and minute, or all.
_TIMES = (time(), time(13), time(13, 7), time(13, 7, 9))
_GERMAN = '"%d.%m.%Y %H:%M:%S"'


@dataclass(frozen=True)
class DateTimes:
    """Stamps that are dates with a time of day, dates alone, which mean midnight, or times of day without a date.

    They are in ISO 8601, 2024-05-01T12:00:00.25+02:00 or 2024-05-01, of which six digits of a fraction of a second are
    read; or in a `format` of strptime like "%d.%m.%Y %H:%M:%S", where seconds (%S) may have a fraction of up to six
    digits after a point or a comma. Stamps that name no zone are in `zone`: "Z", which is UTC, or a fixed offset like
    "+01:00". Times of day, "%H:%M:%S", count from midnight.

    ValueError: a format with a part of a date, or with neither date nor time, or an invalid zone.
    """

    format: str | None = None
    zone: str = "Z"

    def __post_init__(self) -> None:
        if not self.zone.startswith(("Z", "+", "-")) or self._tzinfo is None:
            raise ValueError(f'clock: expected a zone like "Z" or "+01:00", got {self.zone!r}')
        if self._day is None:
            raise ValueError(
                f"clock: expected a format with day, month and year, or with hour and minute, like {_GERMAN}; names of "
                f"zones are not read; got {self.format!r}"
            )

    def seconds(self, stamp: object, _mark: str | None = None) -> Decimal:
        """Return the time [s] since 1970, UTC, or since midnight, in whole microseconds.

        ValueError: this is no text, or has another format.
        """
        if not isinstance(stamp, str):
            raise ValueError(f"expected a date and a time of day as text, got {short(stamp)}")
        try:
            moment = self._read(stamp)
        except ValueError:
            raise ValueError(f"expected a stamp like {self._example}, got {stamp!r}{self._hint}") from None
        moment = moment if moment.tzinfo else moment.replace(tzinfo=self._tzinfo)
        zero = _EPOCH_UTC if self.absolute else datetime.combine(_NO_DAY, _TIMES[0], moment.tzinfo)
        return EXACT.multiply(Decimal((moment - zero) // _MICROSECOND), _MICRO)

    def is_taken_as_utc(self, stamp: str) -> bool:
        """Whether a stamp is a date without a zone, which is read as UTC."""
        return self.absolute and self.zone == "Z" and self._read(stamp).tzinfo is None

    @property
    def absolute(self) -> bool:
        """Whether stamps count from 1970, and not from midnight."""
        return self._day == _DAY

    @cached_property
    def _day(self) -> date | None:
        """The day that strptime reads after strftime wrote 2024-05-17 13:07:09 in the format; None if it is refused.

        It is 2024-05-17, or 1900-01-01 if the format has only a time of day. A format is refused if it has only a part
        of the date, if it has minutes without hours or seconds without minutes, or for %Z, because strptime ignores the
        zone's name.
        """
        if self.format is None:
            return _DAY
        try:
            written = datetime.combine(_DAY, _TIMES[-1], UTC).strftime(self.format)
            found = datetime.strptime(written, self.format)
        except (ValueError, re.error):  # re.error: a directive is repeated
            return None
        days = {_DAY, _NO_DAY} if found.time() != _TIMES[0] else {_DAY}
        is_kept = "%Z" not in self.format and found.time() in _TIMES and found.date() in days
        return found.date() if is_kept else None

    @cached_property
    def _tzinfo(self) -> tzinfo | None:
        try:
            return datetime.fromisoformat(f"2024-05-01T13:00:00{self.zone}").tzinfo
        except ValueError:  # Python refuses offsets of a day or more
            return None

    @property
    def _example(self) -> str:
        return "2024-05-01T12:00:00.25Z" if self.format is None else _EXAMPLE.strftime(self.format)

    @property
    def _hint(self) -> str:
        if self.format is not None:
            return (
                ' ("ISO 8601" as time unit reads stamps like 2024-05-01 12:00:00, and dates of Parquet; a fraction of '
                "a second has six digits at most)"
            )
        other = f"trackably.recordings.DateTimes({_GERMAN}) as time unit reads other formats"
        return f' ({other}; time=("Date", "Time") joins a date and a time of day from two columns)'

    @cached_property
    def _formats(self) -> list[str]:
        """The format, without spaces at its ends, and the same with and without a fraction of a second."""
        whole = _FRACTION.sub("%S", given := (self.format or "").strip())
        others = [] if "%f" in whole else [whole.replace("%S", f"%S{mark}%f") for mark in DECIMAL_MARKS]
        return [given, whole, *others]

    def _read(self, stamp: str) -> datetime:
        text = stamp.strip()
        if self.format is not None:
            for form in self._formats:
                with suppress(ValueError):
                    return datetime.strptime(text, form)
        elif _ISO.fullmatch(text := text.replace("UTC", "Z")):
            return datetime.fromisoformat(_SPACE.sub("", text))
        raise ValueError


@dataclass(frozen=True)
class Ticks:
    """Stamps that count ticks of `length` [s] since some zero; `absolute` if this zero is 1970-01-01 00:00 UTC.

    ValueError: the length is not positive and finite.
    """

    length: Decimal
    absolute: bool = False

    def __post_init__(self) -> None:
        if not (self.length.is_finite() and self.length > 0):
            raise ValueError(f"clock: a tick must take a positive finite time, got {self.length} s")

    def seconds(self, stamp: object, mark: str | None = None) -> Decimal:
        """Return the time [s] since zero, exactly. ValueError: this is no number."""
        return EXACT.multiply(exact(stamp, mark), self.length)


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

    TypeError, ValueError: a rate that is not positive and finite.
    """
    written = Decimal(repr(positive("frames: rate", rate)))
    return Ticks(Context(prec=50).divide(Decimal(1), written))  # 50 digits: far more than a float64 has


def clock_named(clock: object) -> Clock:
    """Return the clock of that name in `CLOCKS`, or a clock as it is. ValueError lists the names."""
    if isinstance(clock, Clock):
        return clock
    if not isinstance(clock, str) or clock not in CLOCKS:
        raise ValueError(
            f"expected a time unit, one of {', '.join(CLOCKS)}, or DateTimes(format) of trackably.recordings, got "
            f"{clock!r}"
        )
    return CLOCKS[clock]


Origin = int | Literal["first"] | None
"""The time zero [ns] on the file's own clock, "first" for the first sample of all signals, or None for the default."""

_EPOCH = datetime(1970, 1, 1)


def zero_of(origin: Origin, absolute: bool, first: Decimal) -> int:
    """Return the origin [ns]: a number as it is given; for "first", the first sample's stamp `first` [s], rounded down.

    None means "first" if the stamps are `absolute`, and otherwise 0, the file's own zero.
    """
    if origin is None:
        origin = "first" if absolute else 0
    if origin != "first":
        return origin
    return int(EXACT.divide(first, NANOSECOND).to_integral_value(ROUND_FLOOR))


def origin_seconds(origin: int) -> Decimal:
    """Convert an origin [ns] to seconds, exactly."""
    return EXACT.multiply(Decimal(origin), NANOSECOND)


def describe_origin(origin: int, absolute: bool) -> str:
    """Format an `origin` [ns] for people: as a date if it is `absolute` (counts from 1970), otherwise in seconds."""
    if not absolute:
        return f"{plain(origin_seconds(origin))} s on the file's own clock"
    seconds, nanoseconds = divmod(origin, 10**9)
    since = f"{origin} ns since 1970"
    try:
        written = (_EPOCH + timedelta(seconds=seconds)).isoformat(" ")
    except OverflowError:  # years beyond 9999, for example if stamps in ms are read as s
        return since
    fraction = f".{nanoseconds:09d}".rstrip("0").rstrip(".")
    return f"{written}{fraction} UTC ({since})"
