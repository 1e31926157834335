"""Read recordings from MCAP files."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from pathlib import Path
from typing import Generic, TypeVar

import numpy as np

from trackably.arrays import Array
from trackably.errors import DoubtfulInputWarning, InputError
from trackably.recordings.chosen import check_mapping, checked_window, path_given
from trackably.recordings.clocks import clock_named, first_doubt
from trackably.recordings.decimals import check_scale, exact, scaled
from trackably.recordings.from_rows import recording_from_rows
from trackably.recordings.mcap_files.fields import find, label_field, labels, leaves
from trackably.recordings.mcap_files.message_times import LOG_TIME, MessageTime, Stamp
from trackably.recordings.mcap_files.messages import Received, read_messages
from trackably.recordings.origin import Origin, checked_origin, zero_of
from trackably.recordings.recording import Recording
from trackably.recordings.repairs import Repair, chosen_repairs
from trackably.recordings.rows import Rows, rows_between

_T = TypeVar("_T")


@dataclass(frozen=True)
class Field:
    """The number at `path` in the messages on `topic`, multiplied by `scale` (1e-3 converts millimetres to metres).

    Then `offset` is added, in the new unit (273.15 makes kelvins of degrees Celsius).
    A path is `pose.position.x`, `joints[2].angle`, or `transforms[child_frame_id=base].transform.translation.x` for the
    entry of a list that has this name. `time` selects the time of a message: LOG_TIME, PUBLISH_TIME or a
    `Stamp` in it. `noise_std` is the path of the standard deviation of each sample, in the unit of the message; it is
    scaled too. InputError: a scale or an offset that is not finite, a scale of zero, or paths that are no texts.
    """

    topic: str
    path: str
    scale: float = 1.0
    time: MessageTime = LOG_TIME
    noise_std: str | None = None
    offset: float = 0.0

    def __post_init__(self) -> None:
        for what, given in (("topic", self.topic), ("path", self.path), ("noise_std", self.noise_std)):
            if not isinstance(given, str) and not (what == "noise_std" and given is None):
                raise InputError(f"Field: {what}: expected a text, got {given!r}")
            if given == "":
                raise InputError(f"Field: {what}: expected a text, got an empty one")
        if not isinstance(self.time, MessageTime):
            raise InputError(
                f'Field: time: expected LOG_TIME, PUBLISH_TIME or Stamp("header.stamp"), got {self.time!r}'
            )
        check_scale(f"{self.topic} {self.path}", self.scale, self.offset)


def read_mcap(
    path: str | Path,
    signals: Mapping[str, Field],
    repairs: Sequence[Repair | str] = (),
    origin: Origin = None,
    between: tuple[float, float] | None = None,
) -> Recording:
    """Read signals from an MCAP file with JSON, Protobuf or ROS 2 messages, compressed or not.

    Parameters
    ----------
    path
        The file.
    signals
        By the name that a signal gets in the recording: a `Field`.
    repairs
        Functions, or names of `REPAIRS`, applied in this order. What they do not mend is refused.
    origin
        The time zero [ns] on the file's clock, or "first" for the first sample of all signals. By default the first
        sample too, or the file's own zero if stamps are numbers in a unit that does not count from 1970.
    between
        Read the samples with start ≤ time ≤ end [s] alone: times of other messages may repeat or go back.

    Messages are read in the order of their log times. Fields without a value (unset, null, NaN, absent from some
    messages) are left out and reported in `Recording.cleanings`.

    Raises
    ------
    InputError
        For a file that cannot be read, and for anything wrong in it that no repair mends: names file, topic, message.

    """
    path = path_given(path)
    check_mapping(path, signals, 'a mapping from names to fields, as {"position": Field("/topic", "x")}')
    for name, wanted in signals.items():
        _refuse_no_field(name, wanted)
    chosen, zero, ends = chosen_repairs(repairs), checked_origin(origin), checked_window(between)
    absolute = {field.time.absolute for field in signals.values()}
    if len(absolute) > 1:
        raise InputError(f"{path}: signals are timed by clocks with different zeros; read them one by one")
    messages = read_messages(path, {field.topic for field in signals.values()})
    groups: dict[tuple[str, MessageTime], dict[str, Field]] = {}
    for name, wanted in signals.items():
        groups.setdefault((wanted.topic, wanted.time), {})[name] = wanted
    tables = [_rows(path, messages[topic], topic, time, fields) for (topic, time), fields in groups.items()]
    if ends:
        seen = (
            t for rows in tables for t, has in zip(rows.stamps, rows.has_value, strict=True) if t is not None and has
        )
        zero = zero_of(zero, True in absolute, min(seen, default=Decimal(0)))
        tables = [rows.only(rows_between(rows.stamps, ends, zero)) for rows in tables]
    found = recording_from_rows(tables, absolute.pop(), chosen, zero)
    for cleaning in found.cleanings:
        for question in cleaning.questions:
            warnings.warn(question, DoubtfulInputWarning, stacklevel=2)
    return replace(found, signals={name: found[name] for name in signals})


def _refuse_no_field(signal: str, wanted: object) -> None:
    if not isinstance(wanted, Field):
        raise InputError(f'signal {signal!r}: expected a Field, as Field("/topic", "path.in.message"), got {wanted!r}')


def _rows(path: Path, messages: Sequence[Received], topic: str, time: MessageTime, fields: Mapping[str, Field]) -> Rows:
    stamps = _Column(time.field, time.seconds)
    values = {name: _numbers(wanted.path, wanted.scale, wanted.offset) for name, wanted in fields.items()}
    noise_std = {
        name: _numbers(wanted.noise_std, abs(wanted.scale))
        for name, wanted in fields.items()
        if wanted.noise_std is not None
    }
    columns: list[_Column[Decimal] | _Column[float]] = [stamps, *values.values(), *noise_std.values()]
    for message in messages:  # one at a time: a decoded message may be much larger than what is kept of it
        content = message.content()
        for column in columns:
            column.take(message, content)
    for column in columns:
        if column.path is not None and not column.found:
            has = ", ".join(leaves(messages[0].content()))
            raise InputError(f"{path}, {topic}: there is no field {column.path!r}; the first message has {has}")
    if isinstance(time, Stamp) and time.unit and (question := first_doubt(clock_named(time.unit), stamps.values)):
        warnings.warn(f"{path}, {topic}: {question}", DoubtfulInputWarning, stacklevel=3)
    return Rows(
        f"{path}, {topic}",
        [f"message {number}" for number in range(1, len(messages) + 1)],
        stamps.values,
        {name: _array(column) for name, column in values.items()},
        {name: _array(column) for name, column in noise_std.items()},
    )


class _Column(Generic[_T]):
    """The values that `read` returns for each message, None if missing; `found` says if any message has the field."""

    def __init__(self, path: str | None, read: Callable[[Received, object], _T | None]) -> None:
        self.path, self.read = path, read
        self.values: list[_T | None] = []
        self.found = False
        self.labels: tuple[str, ...] | None = None

    def take(self, message: Received, content: object) -> None:
        value = None
        try:
            value = self.read(message, content)
            self.found = True
            self._refuse_others(message, content)
        except LookupError:
            pass
        except ValueError as error:
            raise InputError(f"{message.place}, field {self.path!r}: {error}") from error
        self.values.append(value)

    def _refuse_others(self, message: Received, content: object) -> None:
        """Raise InputError where the number in a path means another frame than it did before, as in `/tf`."""
        if self.path is None or "[" not in self.path:
            return
        named = labels(content, self.path)
        if self.labels is not None and named != self.labels:
            raise InputError(
                f"{message.place}, field {self.path!r}: is of {', '.join(named)} here, and was of "
                f"{', '.join(self.labels)} before; name the one that is meant: {label_field(content, self.path)}"
            )
        self.labels = named


def _numbers(path: str, scale: float, offset: float = 0.0) -> _Column[float]:
    def read(_: Received, content: object) -> float | None:
        number = exact(find(content, path))
        return None if number is None else scaled(number, scale, offset)

    return _Column(path, read)


def _array(column: _Column[float]) -> Array:
    return np.array([np.nan if value is None else value for value in column.values])
