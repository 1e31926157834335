"""The time of a message: its log time, its publish time, or a stamp inside it."""

from dataclasses import dataclass
from decimal import Decimal

from trackably.errors import InputError
from trackably.recordings.clocks import Clock, clock_named
from trackably.recordings.dates import DateTimes
from trackably.recordings.decimals import EXACT, NANOSECOND, exact, shown
from trackably.recordings.mcap_files.fields import find
from trackably.recordings.mcap_files.messages import Received

_PAIRS = (("sec", "nanosec"), ("sec", "nsec"), ("secs", "nsecs"), ("seconds", "nanos"))
"""The names of seconds and nanoseconds in ROS 2, Foxglove, ROS 1 and Protobuf."""


@dataclass(frozen=True)
class LogTime:
    """The time at which the message was recorded."""

    field: None = None
    absolute: bool = True

    def seconds(self, message: Received, _content: object) -> Decimal | None:
        """Return the time [s], exactly."""
        return EXACT.multiply(Decimal(message.log_time), NANOSECOND)


@dataclass(frozen=True)
class PublishTime:
    """The time at which the message was published."""

    field: None = None
    absolute: bool = True

    def seconds(self, message: Received, _content: object) -> Decimal | None:
        """Return the time [s], exactly."""
        return EXACT.multiply(Decimal(message.publish_time), NANOSECOND)


@dataclass(frozen=True)
class Stamp:
    """The time stamp in the `field` of a message.

    `unit` is the name of a clock in `CLOCKS`, or a clock. Without one, the field has seconds and nanoseconds, as stamps
    of ROS and Protobuf have. InputError: an unknown name.
    """

    field: str
    unit: str | Clock | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.field, str):
            raise InputError(f"Stamp: field: expected the path of a field, as 'header.stamp', got {self.field!r}")
        if self.unit is not None:
            object.__setattr__(self, "unit", clock_named(self.unit))

    @property
    def absolute(self) -> bool:
        """Whether stamps count from 1970, not from the file's own zero."""
        return self.unit is None or clock_named(self.unit).absolute

    def seconds(self, _message: Received, content: object) -> Decimal | None:
        """Return the time [s], exactly; None if it is unset. LookupError: no such field. ValueError: no valid stamp."""
        found = find(content, self.field)
        if found is None:
            return None
        if self.unit is None:
            return _pair(found)
        clock = clock_named(self.unit)
        if isinstance(clock, DateTimes):
            if not isinstance(found, str):
                raise ValueError(f"expected a date and a time of day as text, got {shown(found)}")
            return clock.seconds(found)
        number = exact(found)
        return None if number is None else clock.seconds(number)


MessageTime = LogTime | PublishTime | Stamp
LOG_TIME = LogTime()
PUBLISH_TIME = PublishTime()


def _pair(stamp: object) -> Decimal:
    for names in _PAIRS:
        try:
            seconds, nanoseconds = (exact(find(stamp, name)) for name in names)
        except LookupError:
            continue
        if seconds is not None and nanoseconds is not None:
            return EXACT.add(seconds, EXACT.multiply(nanoseconds, NANOSECOND))
    raise ValueError(f"expected seconds and nanoseconds, got {shown(stamp)} (a number or a text needs its unit said)")
