"""Convert stamps that are dates with a time of day to seconds since 1970, exactly."""

import re
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta, tzinfo
from decimal import Decimal
from functools import cached_property
from typing import ClassVar

from trackably.errors import InputError
from trackably.recordings.decimals import EXACT

_ZONE = r"Z|[+-][\d:]+"
_DAY = re.compile(r"\d{4}-\d\d-\d\d", re.ASCII)
_ISO = re.compile(
    rf"(?P<start>\d{{4}}-?\d\d-?\d\d[T ]\d\d:?\d\d:?\d\d)(?:[.,](?P<fraction>\d+))?(?P<zone>{_ZONE})?", re.ASCII
)
_WITH_FRACTION = re.compile(r"(?P<whole>.*)[.,](?P<fraction>\d+)", re.ASCII)
_FRACTION_AT_END = re.compile(r"(?<=%S)[.,]%f$")
_TIME = re.compile("%[HIMSpfXcT]")
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_MICROSECOND = timedelta(microseconds=1)
_EXAMPLE = datetime(2024, 5, 1, 13, tzinfo=UTC)
_PROBE = datetime(2024, 5, 17, 13, tzinfo=UTC)  # no field has the value that strptime takes for one left out
_GERMAN = '"%d.%m.%Y %H:%M:%S"'


@dataclass(frozen=True)
class DateTimes:
    """Stamps that are dates with a time of day, or dates alone, which mean midnight.

    They are in ISO 8601, 2024-05-01T12:00:00.25+02:00 or 2024-05-01, or in a `format` of strptime like
    "%d.%m.%Y %H:%M:%S". If the format ends with seconds, a stamp may have a fraction of any length after a point or a
    comma. Stamps that name no zone are in `zone`: "Z", which is UTC, or a fixed offset like "+01:00".

    InputError: a format without a complete date, or an invalid zone.
    """

    format: str | None = None
    zone: str = "Z"
    absolute: ClassVar[bool] = True

    def __post_init__(self) -> None:
        if self._tzinfo is None:
            raise InputError(f'clock: expected a zone like "Z" or "+01:00", got {self.zone!r}')
        if self.format is not None and not _tells_a_date(self._whole):
            raise InputError(
                f"clock: expected a format with day, month and year (and hour), and without the name of a zone, "
                f"like {_GERMAN}, got {self.format!r}"
            )

    def seconds(self, stamp: str) -> Decimal:
        """Return the time [s] since 1970, UTC, exactly. ValueError: a text that is no such stamp."""
        try:
            moment, fraction = self._read_iso(stamp.strip()) if self.format is None else self._read(stamp.strip())
        except ValueError:
            raise ValueError(f"expected a stamp like {self._example}, got {stamp!r}{self._hint}") from None
        whole = EXACT.multiply(Decimal((moment - _EPOCH) // _MICROSECOND), Decimal("1e-6"))
        return EXACT.add(whole, Decimal(f"0.{fraction}"))

    @cached_property
    def _whole(self) -> str:
        """The format without a fraction at its end: strptime reads one to six digits only, here any number is read."""
        return _FRACTION_AT_END.sub("", (self.format or "").strip())

    @cached_property
    def _tzinfo(self) -> tzinfo | None:
        try:
            zone = re.fullmatch(_ZONE, self.zone, re.ASCII)
            return datetime.fromisoformat(f"2024-05-01T13:00:00{self.zone}").tzinfo if zone else None
        except ValueError:  # an offset longer than a day
            return None

    @property
    def _example(self) -> str:
        return "2024-05-01T12:00:00.25Z" if self.format is None else _EXAMPLE.strftime(self.format)

    @property
    def _hint(self) -> str:
        return f" (DateTimes({_GERMAN}) as time unit reads other formats)" if self.format is None else ""

    def _read_iso(self, text: str) -> tuple[datetime, str]:
        if _DAY.fullmatch(text):
            return datetime.fromisoformat(f"{text}T00:00:00{self.zone}"), "0"
        match = _ISO.fullmatch(text)
        if match is None:
            raise ValueError
        # datetime would silently cut the fraction after six digits.
        return datetime.fromisoformat(match["start"] + (match["zone"] or self.zone)), match["fraction"] or "0"

    def _read(self, text: str) -> tuple[datetime, str]:
        fraction = "0"
        try:
            moment = datetime.strptime(text, self._whole)
        except ValueError:
            # The whole text was tried first: day, month and year may be separated by points, too.
            match = _WITH_FRACTION.fullmatch(text) if self._whole.endswith("%S") else None
            if match is None:
                raise
            moment, fraction = datetime.strptime(match["whole"], self._whole), match["fraction"]
        return (moment if moment.tzinfo else moment.replace(tzinfo=self._tzinfo)), fraction


def _tells_a_date(format_: str) -> bool:
    """Whether a date written in this format is read back unchanged; %Z is refused, as strptime ignores the name.

    A format without a time of day means midnight.
    """
    try:
        found = datetime.strptime(_PROBE.strftime(format_), format_)
    except (ValueError, re.error):  # re.error: a directive is repeated
        return False
    expected = _PROBE.replace(tzinfo=None) if _TIME.search(format_) else _PROBE.replace(tzinfo=None, hour=0)
    return "%Z" not in format_ and found.replace(tzinfo=None) == expected
