"""Messages of any MCAP file, decoded.

`pipeline.storage.logs` knows MCAP as well, and stays the only file that writes it. That one is strict: it reads only
what this
project wrote, and accounts for every byte of it. This one is for what other people recorded: any writer, chunks in any
compression, JSON, Protobuf and ROS 2 messages, the last two through the decoders of the MCAP project.
"""

import json
import struct
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path

from mcap.exceptions import EndOfFile
from mcap.records import Channel, McapRecord, Message, Schema
from mcap.stream_reader import StreamReader
from mcap.well_known import MessageEncoding
from mcap_protobuf.decoder import DecoderFactory as ProtobufDecoders
from mcap_ros2.decoder import DecoderFactory as Ros2Decoders

from trackable.errors import InputError
from trackable.files import unreadable

Decode = Callable[[bytes], object]


@dataclass(frozen=True)
class Received:
    """A message: `place` says which one, times are in ns since whatever zero the recorder had, most often 1970."""

    place: str
    log_time: int
    publish_time: int
    data: bytes
    decode: Decode

    def content(self) -> object:
        """What the message says: dictionaries and lists, a Protobuf message, or a ROS 2 one. InputError: damaged."""
        try:
            return self.decode(self.data)
        except Exception as error:  # decoders raise much, not documented, of classes that are private in part
            raise InputError(f"{self.place}: it cannot be decoded ({_reason(error)})") from error


def read_messages(path: Path, topics: Collection[str]) -> dict[str, list[Received]]:
    """The messages of each topic in the order of their log times.

    Raises InputError, naming the file and what it holds, where it is no MCAP file, damaged or cut off, or has no such
    topic, or no messages on it, or these are in an encoding that is not read.
    """
    schemas: dict[int, Schema] = {}
    channels: dict[int, Channel] = {}
    counts: dict[int, int] = {}
    messages: dict[str, list[Message]] = {topic: [] for topic in topics}
    for record in _records(path):
        match record:
            case Schema():
                schemas[record.id] = record
            case Channel():
                channels[record.id] = record
            case Message():
                if record.channel_id not in channels:
                    raise InputError(f"{path}: a message is of channel {record.channel_id}, which is not described")
                counts[record.channel_id] = counts.get(record.channel_id, 0) + 1
                if (topic := channels[record.channel_id].topic) in messages:
                    messages[topic].append(record)
    listed = ", ".join(sorted(_described(c, schemas.get(c.schema_id), counts.get(i, 0)) for i, c in channels.items()))
    for topic, received in messages.items():
        if not received:
            known = any(channel.topic == topic for channel in channels.values())
            lacks = f"there are no messages on the topic {topic!r}" if known else f"there is no topic {topic!r}"
            raise InputError(f"{path}: {lacks}; there are {listed or 'none'}")
    ids = {record.channel_id for received in messages.values() for record in received}
    decoders = {i: _decoder(path, channels[i], schemas.get(channels[i].schema_id)) for i in ids}
    return {
        topic: [
            Received(f"{path}, {topic}, message {number}", r.log_time, r.publish_time, r.data, decoders[r.channel_id])
            for number, r in enumerate(sorted(received, key=lambda r: r.log_time), start=1)
        ]
        for topic, received in messages.items()
    }


def _records(path: Path) -> Iterator[McapRecord]:
    """All records in the order of the file, its checksums checked on the way."""
    try:
        with path.open("rb") as file:
            size = path.stat().st_size  # no record is longer: a damaged length asks for no memory
            yield from StreamReader(file, validate_crcs=True, record_size_limit=size).records
    except OSError as error:
        raise unreadable(path, error) from error
    except Exception as error:  # beside the library's own: of struct, of both compressors, of text, of memory
        cut = "it ends too early (if a recorder was cut off, 'mcap recover' of the MCAP project saves what there is)"
        reason = cut if isinstance(error, EndOfFile | struct.error) else _reason(error)
        raise InputError(f"{path}: no MCAP file, or damaged: {reason}") from error


def _reason(error: Exception) -> str:
    return str(error) or type(error).__name__


def _described(channel: Channel, schema: Schema | None, count: int) -> str:
    return f"{channel.topic} ({channel.message_encoding}{f' {schema.name}' if schema else ''}, {count} messages)"


def _decoder(path: Path, channel: Channel, schema: Schema | None) -> Decode:
    if channel.message_encoding == MessageEncoding.JSON:
        return _from_json
    try:
        for factory in (ProtobufDecoders(), Ros2Decoders()):
            if decode := factory.decoder_for(channel.message_encoding, schema):
                return decode
    except Exception as error:  # as above: a schema is foreign text, parsed by foreign code
        raise InputError(f"{path}, {channel.topic}: its schema cannot be understood ({_reason(error)})") from error
    described = f"schemas in {schema.encoding!r}" if schema else "no schema"
    raise InputError(
        f"{path}, {channel.topic}: expected messages in JSON, in Protobuf, or of ROS 2 (cdr, with schemas in ros2msg), "
        f"got {channel.message_encoding!r} with {described}"
    )


def _from_json(data: bytes) -> object:
    """Fractions stay exact; NaN and infinities, which are no JSON but are often written, come as floats."""
    content: object = json.loads(data, parse_float=Decimal)
    return content
