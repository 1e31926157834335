"""When a message was: the ways of an MCAP file to say it."""

from dataclasses import dataclass
from decimal import Decimal

from trackable.recordings.clocks import Clock, clock_named
from trackable.recordings.dates import DateTimes
from trackable.recordings.decimals import EXACT, NANOSECOND, exact, shown
from trackable.recordings.mcap_files.fields import find
from trackable.recordings.mcap_files.messages import Received

_PAIRS = (("sec", "nanosec"), ("sec", "nsec"), ("secs", "nsecs"), ("seconds", "nanos"))
"""As ROS 2, Foxglove, ROS 1 and Protobuf call seconds and nanoseconds."""


@dataclass(frozen=True)
class LogTime:
    """When the message was recorded."""

    field: None = None
    absolute: bool = True

    def seconds(self, message: Received, _content: object) -> Decimal | None:
        """The time [s], exactly."""
        return EXACT.multiply(Decimal(message.log_time), NANOSECOND)


@dataclass(frozen=True)
class PublishTime:
    """When the message was sent."""

    field: None = None
    absolute: bool = True

    def seconds(self, message: Received, _content: object) -> Decimal | None:
        """The time [s], exactly."""
        return EXACT.multiply(Decimal(message.publish_time), NANOSECOND)


@dataclass(frozen=True)
class Stamp:
    """The time that the message itself has in `field`: seconds with nanoseconds, or, with a `unit`, what this says.

    `unit` is one of `CLOCKS`, by name, or a clock of one's own. InputError where there is none of that name.
    """

    field: str
    unit: str | Clock | None = None

    def __post_init__(self) -> None:
        if self.unit is not None:
            object.__setattr__(self, "unit", clock_named(self.unit))

    @property
    def absolute(self) -> bool:
        """Whether zero is not the file's own."""
        return self.unit is None or clock_named(self.unit).absolute

    def seconds(self, _message: Received, content: object) -> Decimal | None:
        """The time [s], exactly; None where there is none. LookupError: no such field; ValueError: no such stamp."""
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
