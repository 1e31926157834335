"""Read recordings from MCAP files."""

from __future__ import annotations

import json
import re
import struct
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from decimal import Decimal
from functools import partial
from itertools import islice
from pathlib import Path
from types import SimpleNamespace
from typing import TypeGuard

from google.protobuf.message import Message as Protobuf
from lz4.frame import LZ4FrameDecompressor
from mcap.exceptions import EndOfFile
from mcap.records import Channel, Chunk, McapRecord, Message, Schema
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.well_known import MessageEncoding
from mcap_protobuf.decoder import DecoderFactory as ProtobufDecoders
from mcap_ros2.decoder import DecoderFactory as Ros2Decoders
from zstandard import ZstdDecompressor

from trackably.arguments import instance, short, text
from trackably.errors import InputError
from trackably.files import open_input, path_of
from trackably.recordings.clocks import EXACT, NANOSECOND, Clock, Origin, clock_named, exact
from trackably.recordings.recording import Recording
from trackably.recordings.rows import Repair
from trackably.recordings.tables import (
    LARGEST,
    Column,
    Reading,
    Table,
    check_signals,
    is_none,
    recording_of,
    refuse_no_mcap,
)

# Paths of fields in messages, such as "joints[2].angle", "transforms[child_frame_id=base].transform.translation.x", or
# "position[name=elbow]" for the entry whose name is in the list beside it, as in ROS's JointState.

_ENTRY = re.compile(r"\[(?:(?P<index>[0-9]+)|(?P<field>[^=\[\]]+)=(?P<value>[^\]]*))\]\.?")
_LABELS = ("child_frame_id", "name")  # fields that name an entry of a list
_DEPTH, _LISTED = 8, 60  # error messages search this many levels of a message, and list this many paths


def locate(message: object, path: str) -> tuple[object, str]:
    """Return the value at `path` in a decoded message, and the entries of lists on the way, as "[child_frame_id=base]".

    The value is None if it, or a message around it, is unset or null. An entry without a name is written as "[2]".
    LookupError: there is no such field. ValueError: several entries of a list have the name in the path.
    """
    node, around, rest, entries = message, dict[str, object](), path, ""
    while rest and node is not None:
        if (fields := _fields(node)) is not None:
            # A key may contain dots, such as "left.rate" in this project's logs: the longest one is taken.
            known = (name for name in fields if f"{rest}.".startswith((f"{name}.", f"{name}[")))
            name = max(known, key=len, default="")
            node, around, rest = fields[name], {**fields}, rest[len(name) :].removeprefix(".")
        elif _is_list(node) and (entry := _ENTRY.match(rest)):
            number, field, wanted = entry.groups()
            name_of = partial(_name_of_entry, node, around)
            found = [int(number)] if number else [i for i in range(len(node)) if name_of(i, field) == wanted]
            if len(found) > 1:
                raise ValueError(
                    f"expected one entry of a list with {field} = {wanted!r}, got {len(found)} entries with it; "
                    "write the number of the entry, as [0]"
                )
            i, labels = found[0], [field] if field else _LABELS  # an IndexError if there is none
            entries += next((f"[{of}={name}]" for of in labels if (name := name_of(i, of))), f"[{i}]")
            node, rest = node[i], rest[entry.end() :]
        else:
            raise LookupError(path)
    return node, entries


def find(node: object, path: str) -> object:
    """Return the value at `path` in a decoded message. Raises the errors of `locate`."""
    return locate(node, path)[0]


def leaves(message: object) -> list[str]:
    """Return the paths of numbers and texts in a message, for error messages.

    Of each list, only the first entry is examined. If there are too many paths, the last one is "…".
    """
    found = list(islice(_leaves(message, "", _DEPTH), _LISTED + 1))
    return found if len(found) <= _LISTED else [*found[:_LISTED], "…"]


def _is_list(node: object) -> TypeGuard[Sequence[object]]:
    return isinstance(node, Sequence) and not isinstance(node, str)


def _name_of_entry(entries: Sequence[object], around: Mapping[str, object], i: int, field: str) -> str:
    """Return the name of list entry i, "" for none: a text in its own `field`.

    If the message around the list also has a list `field`, of equal length, the name is entry i of that list.
    """
    name: object = None
    match around.get(field):
        case [*names] if len(names) == len(entries):
            name = names[i]
        case _:
            with suppress(LookupError):
                name = find(entries[i], field)
    return name if isinstance(name, str) else ""


def _fields(node: object) -> Mapping[str, object] | None:
    """Return the fields of a message by name, with None for unset ones; None if `node` is no message.

    Some fields of Protobuf distinguish unset from zero.
    """
    match node:
        case Mapping():
            return node
        case Protobuf():
            return {
                name: getattr(node, name) if not field.has_presence or node.HasField(name) else None
                for name, field in node.DESCRIPTOR.fields_by_name.items()
            }
        case SimpleNamespace():
            return {name: getattr(node, name) for name in getattr(type(node), "__slots__", ())}
    return None


def _leaves(node: object, path: str, depth: int) -> Iterator[str]:
    if depth == 0:
        return
    if isinstance(node, int | float | Decimal | str):
        yield path
    elif isinstance(node, Sequence) and node:
        yield from _leaves(node[0], f"{path}[0]", depth - 1)
    for name, child in (_fields(node) or {}).items():
        yield from _leaves(child, f"{path}.{name}" if path else str(name), depth - 1)


Decode = Callable[[bytes], object]

_CHUNK = 100_000_000  # bytes: larger chunks are refused; recorders write a few million bytes, or a single message
_MESSAGE = 200  # bytes of a message in memory, in addition to its data
_START = 512  # bytes that tell what kind of file it is


@dataclass(frozen=True)
class Received:
    """An undecoded message, and its `place` for error messages.

    Its times [ns] count from the recorder's zero, which is often 1970.
    """

    place: str
    message: Message
    decode: Decode

    def content(self) -> object:
        """Decode the message: dictionaries and lists, a Protobuf or a ROS 2 message. InputError: it is damaged."""
        try:
            return self.decode(self.message.data)
        except Exception as error:  # decoders raise undocumented errors, some of private classes
            raise InputError(f"{self.place}: it cannot be decoded ({_reason(error)})") from error


def read_messages(path: Path, topics: Collection[str]) -> dict[str, list[Received]]:
    """Read the messages of each topic, in the order of their log times.

    InputError, with the name and topics of the file: it is no MCAP file, damaged or cut off; it has no such topic, or
    no messages on it; an encoding is not supported.
    """
    schemas: dict[int, Schema] = {}
    channels: dict[int, Channel] = {}
    counts = Counter[int]()
    messages: dict[str, list[Message]] = {topic: [] for topic in topics}
    kept = 0
    for record in records_in(path):
        match record:
            case Schema():
                schemas[record.id] = record
            case Channel():
                channels[record.id] = record
            case Message(channel_id=number) if number not in channels:
                raise InputError(
                    f"{path}: damaged, as a message belongs to channel {number}, which the file does not describe"
                )
            case Message(channel_id=number):
                counts[number] += 1
                if (topic := channels[number].topic) in messages:
                    messages[topic].append(record)
                    kept += _MESSAGE + len(record.data)
                    if kept > LARGEST:
                        raise InputError(
                            f"{path}: messages on {', '.join(messages)} take more than {LARGEST} bytes: split the file"
                        )
    listed = ", ".join(sorted(_describe(c, schemas.get(c.schema_id), counts[i]) for i, c in channels.items()))
    for topic, received in messages.items():
        if not received:
            known = any(channel.topic == topic for channel in channels.values())
            lacks = f"there are no messages on the topic {topic!r}" if known else f"there is no topic {topic!r}"
            raise InputError(f"{path}: {lacks}; there are {listed or 'none'}")
    decoders = {
        i: _decoder(path, channel, schemas.get(channel.schema_id))
        for i, channel in channels.items()
        if channel.topic in messages and counts[i]
    }
    return {
        topic: [
            Received(f"{path}, {topic}, message {number}", r, decoders[r.channel_id])
            for number, r in enumerate(sorted(received, key=lambda r: r.log_time), start=1)
        ]
        for topic, received in messages.items()
    }


def topics_in(path: Path) -> list[str]:
    """Return the topics of a file, sorted by name. InputError: it is no MCAP file, damaged or cut off."""
    return sorted({record.topic for record in records_in(path) if isinstance(record, Channel)})


def records_in(path: Path) -> Iterator[McapRecord]:
    """Yield all records in the order of the file, chunks unpacked, and verify its checksums.

    InputError: it is no MCAP file, damaged or cut off.
    """
    try:
        with open_input(path) as file:
            refuse_no_mcap(path, file.read(_START))
            file.seek(0)
            size = path.stat().st_size  # no record is longer than the file, whatever a damaged length says
            for record in StreamReader(file, validate_crcs=True, record_size_limit=size, emit_chunks=True).records:
                match record:
                    case Chunk():
                        yield from breakup_chunk(_unpack(path, record), validate_crc=True)
                    case _:
                        yield record
    except InputError:
        raise
    except Exception as error:  # errors of struct, both compressors, text and memory, beside those of the library
        cut = "it ends too early (if a recorder was cut off, 'mcap recover' of the MCAP project saves what there is)"
        reason = cut if isinstance(error, EndOfFile | struct.error) else _reason(error)
        raise InputError(f"{path}: no MCAP file, or damaged: {reason}") from error


def _unpack(path: Path, chunk: Chunk) -> Chunk:
    """Return the chunk unpacked. InputError: its size is not as declared, or larger than recorders make chunks."""
    size = len(chunk.data) if chunk.compression not in _UNPACK else chunk.uncompressed_size
    if size > _CHUNK:
        raise InputError(f"{path}: a chunk has {size} bytes, but at most {_CHUNK} are read: write smaller chunks")
    if chunk.compression not in _UNPACK:
        return chunk
    data = _UNPACK[chunk.compression](chunk.data, size + 1)
    if len(data) != size:
        raise InputError(f"{path}: no MCAP file, or damaged: a chunk does not unpack to the {size} bytes that it says")
    return replace(chunk, compression="", data=data)


_UNPACK: dict[str, Callable[[bytes, int], bytes]] = {
    "zstd": lambda data, most: ZstdDecompressor().stream_reader(data).read(most),
    "lz4": lambda data, most: LZ4FrameDecompressor().decompress(data, max_length=most),
}
"""Functions that unpack data up to a number of bytes, by the name of the compression."""


def _reason(error: Exception) -> str:
    return str(error) or type(error).__name__


def _describe(channel: Channel, schema: Schema | None, count: int) -> str:
    return f"{channel.topic} ({channel.message_encoding}{f' {schema.name}' if schema else ''}, {count} messages)"


def _decoder(path: Path, channel: Channel, schema: Schema | None) -> Decode:
    if channel.message_encoding == MessageEncoding.JSON:
        return _from_json
    try:
        for factory in (ProtobufDecoders(), Ros2Decoders()):
            if decode := factory.decoder_for(channel.message_encoding, schema):
                return decode
    except Exception as error:  # parsers of schemas raise undocumented errors
        raise InputError(f"{path}, {channel.topic}: its schema cannot be understood ({_reason(error)})") from error
    described = f"schemas in {schema.encoding!r}" if schema else "no schema"
    raise InputError(
        f"{path}, {channel.topic}: expected messages in JSON, in Protobuf, or of ROS 2 (cdr, with schemas in ros2msg), "
        f"got {channel.message_encoding!r} with {described}"
    )


def _from_json(data: bytes) -> object:
    """Decode JSON: fractions stay exact; NaN and infinities, often written though not valid JSON, become floats."""
    content: object = json.loads(data, parse_float=Decimal)
    return content


_PAIRS = (("sec", "nanosec"), ("sec", "nsec"), ("secs", "nsecs"), ("seconds", "nanos"))
"""The names of seconds and nanoseconds in ROS 2, Foxglove, ROS 1 and Protobuf."""


@dataclass(frozen=True)
class Stamp:
    """The time stamp in the `field` of a message, or of the recorder's record of it.

    `unit` is the name of a clock in `CLOCKS`, or a clock. Without one, the field has seconds and nanoseconds, as stamps
    of ROS and Protobuf have. TypeError: the field is no text. ValueError: an unknown name.
    """

    field: str
    unit: str | Clock | None = None
    of_record: bool = False

    def __post_init__(self) -> None:
        instance("Stamp: field", self.field, str, "the path of a field, as 'header.stamp'")
        _ = self.clock

    @property
    def clock(self) -> Clock:
        """The clock of the stamps."""
        return clock_named("epoch s" if self.unit is None else self.unit)

    def of(self, message: Received, content: object) -> tuple[object, str]:
        """Return the time stamp of a message, None if it is unset, and the entries of lists on the way to it.

        LookupError: the message has no such field. ValueError: the field has no seconds and nanoseconds.
        """
        found, entries = (getattr(message.message, self.field), "") if self.of_record else locate(content, self.field)
        return found if found is None or self.unit is not None else _pair(found), entries


LOG_TIME = Stamp("log_time", "epoch ns", of_record=True)
"""The time at which a message was recorded."""

PUBLISH_TIME = Stamp("publish_time", "epoch ns", of_record=True)
"""The time at which a message was published."""


def _pair(stamp: object) -> Decimal:
    for names in _PAIRS:
        with suppress(LookupError):
            parts = [find(stamp, name) for name in names]
            if not any(map(is_none, parts)):
                seconds, nanoseconds = map(exact, parts)
                return EXACT.add(seconds, EXACT.multiply(nanoseconds, NANOSECOND))
    raise ValueError(
        f"expected seconds and nanoseconds, got {short(stamp)} (give the unit of a stamp that is a number or a text)"
    )


@dataclass(frozen=True)
class Field:
    """The number at `path` in the messages on `topic`, multiplied by `scale` (1e-3 converts millimetres to metres).

    Then `offset` is added, in the new unit (273.15 converts degrees Celsius to kelvins). Examples of a path are
    `pose.position.x`, `joints[2].angle`, and `transforms[child_frame_id=base].transform.translation.x` for the entry of
    a list that has this name; `position[name=elbow]` is the entry of `position` where the list `name` beside it has
    `elbow`, as in ROS's JointState. `time` selects the time of a message: LOG_TIME, PUBLISH_TIME or a `Stamp` in it.
    TypeError, ValueError: as for a `Column`, or `topic` is no name, or `time` none of these.
    """

    topic: str
    path: str
    scale: float = 1.0
    time: Stamp = LOG_TIME
    offset: float = 0.0

    def __post_init__(self) -> None:
        if not text("Field: topic", self.topic):
            raise ValueError("Field: topic: expected the name of a topic, got ''")
        instance("Field: time", self.time, Stamp, 'LOG_TIME, PUBLISH_TIME or a Stamp, as Stamp("header.stamp")')
        _ = self.column

    @property
    def column(self) -> Column:
        """The field as a column of the messages on its topic."""
        return Column(self.path, self.scale, self.offset)


def read_mcap(
    path: str | Path,
    signals: Mapping[str, Field],
    repairs: Sequence[Repair | str] = (),
    origin: Origin = None,
) -> Recording:
    """Read signals from an MCAP file with JSON, Protobuf or ROS 2 messages, compressed or not.

    Parameters
    ----------
    path
        The file.
    signals
        By the name that a signal gets in the recording: a `Field`.
    repairs
        Functions, or names of `REPAIRS`, applied in this order. Remaining errors are refused.
    origin
        The time zero [ns] on the file's clock, or "first" for the first sample of all signals. By default the first
        sample too, or the file's own zero if stamps are numbers in a unit that does not count from 1970.

    Messages are read in the order of their log times. Fields without a value (unset, null, NaN, absent from some
    messages) are left out and reported in `Recording.cleanings`.

    Raises
    ------
    InputError
        For a file that cannot be read, and for any error in it that no repair removes; names file, topic, message.
    TypeError, ValueError
        For a wrong argument, before anything is read.
    """
    path = path_of("path", path)
    check_signals(signals, Field, 'a Field, as {"position": Field("/topic", "path.in.message")}')
    groups: dict[tuple[str, Stamp], dict[str, Column]] = {}
    for name, of in signals.items():
        groups.setdefault((of.topic, of.time), {})[name] = of.column
    readings = {
        (topic, time): Reading(f"time stamp {time.field}", time.clock, of, repairs, origin)
        for (topic, time), of in groups.items()
    }
    if len({of.clock.absolute for of in readings.values()}) > 1:
        raise ValueError(
            "signals: their clocks count from different zeros; read signals of different clocks by calls of their own"
        )
    messages = read_messages(path, {topic for topic, _ in readings})
    found = recording_of(
        *((of, _table(f"{path}, {topic}", of, messages[topic], time)) for (topic, time), of in readings.items())
    )
    return replace(found, signals={name: found[name] for name in signals})


_ONE_NUMBER = "; a path leads to one number: position[0] or position[name=elbow] is an entry of a list"


def _table(source: str, reading: Reading, messages: Sequence[Received], time: Stamp) -> Table:
    """Return a table with a row for each message, and None for a missing field.

    InputError: a field is in no message, or a message is damaged.
    """
    paths = {name: time.field if name == reading.time else name for name in reading.names}
    columns: dict[str, list[object]] = {name: [] for name in paths}
    missing, before = {*paths}, dict[str, str]()
    for message in messages:  # one at a time, as a decoded message may be much larger than the values kept
        content = message.content()
        for name, path in paths.items():
            value = None
            try:
                value, entries = time.of(message, content) if name == reading.time else locate(content, name)
                missing.discard(name)
                if value is not None and (first := before.setdefault(name, entries)) != entries:
                    raise ValueError(f"is of {entries} here, and was of {first} before; write {first} in its path")
            except LookupError:
                pass
            except ValueError as error:
                raise InputError(f"{message.place}, field {path!r}: {error}") from error
            columns[name].append(None if is_none(value) else value)
    if absent := [path for name, path in paths.items() if name in missing]:
        has = ", ".join(leaves(messages[0].content()))
        raise InputError(f"{source}: there is no field {absent[0]!r}; the first message has {has}")
    places = [f"message {number}" for number in range(1, len(messages) + 1)]
    return Table(source, places, columns, what="field", advice=_ONE_NUMBER)
