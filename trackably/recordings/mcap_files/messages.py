"""Read and decode the messages of any MCAP file.

Files of any writer, with or without compressed chunks. Messages may be in JSON, Protobuf or ROS 2; the last two are
decoded by the MCAP project's own decoders.
"""

import json
import struct
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, replace
from decimal import Decimal
from pathlib import Path

from lz4.frame import LZ4FrameDecompressor
from mcap.exceptions import EndOfFile
from mcap.records import Channel, Chunk, McapRecord, Message, Schema
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.well_known import MessageEncoding
from mcap_protobuf.decoder import DecoderFactory as ProtobufDecoders
from mcap_ros2.decoder import DecoderFactory as Ros2Decoders
from zstandard import ZstdDecompressor

from trackably.errors import InputError
from trackably.files import opened
from trackably.recordings.file_kinds import LARGEST, refuse_no_mcap

Decode = Callable[[bytes], object]

_CHUNK = 100_000_000  # bytes of a chunk that is unpacked: recorders write a few millions, or a single message
_MESSAGE = 200  # bytes, beside its data
_START = 512  # bytes that tell what kind of file it is


@dataclass(frozen=True)
class Received:
    """An undecoded message: its `place` for error messages, its times [ns] since the recorder's zero, often 1970."""

    place: str
    log_time: int
    publish_time: int
    data: bytes
    decode: Decode

    def content(self) -> object:
        """Decode the message: dictionaries and lists, a Protobuf or a ROS 2 message. InputError: it is damaged."""
        try:
            return self.decode(self.data)
        except Exception as error:  # decoders raise undocumented errors, some of private classes
            raise InputError(f"{self.place}: it cannot be decoded ({_reason(error)})") from error


def read_messages(path: Path, topics: Collection[str]) -> dict[str, list[Received]]:
    """Read the messages of each topic, in the order of their log times.

    InputError, with the name and topics of the file: no MCAP file, damaged or cut off; no such topic; no messages on
    it; an encoding that is not supported.
    """
    schemas: dict[int, Schema] = {}
    channels: dict[int, Channel] = {}
    counts: dict[int, int] = {}
    messages: dict[str, list[Message]] = {topic: [] for topic in topics}
    kept = 0
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
                    kept += _MESSAGE + len(record.data)
                    if kept > LARGEST:
                        raise InputError(
                            f"{path}: the messages on {', '.join(messages)} take more than {LARGEST} bytes"
                        )
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


def topics_in(path: Path) -> list[str]:
    """Return the topics of a file, sorted by name. InputError: no MCAP file, damaged or cut off."""
    return sorted({record.topic for record in _records(path) if isinstance(record, Channel)})


def _records(path: Path) -> Iterator[McapRecord]:
    """Yield all records in the order of the file, checking its checksums."""
    try:
        with opened(path) as file:
            refuse_no_mcap(path, file.read(_START))
            file.seek(0)
            size = path.stat().st_size  # no record is longer: a damaged length must not allocate memory
            for record in StreamReader(file, validate_crcs=True, record_size_limit=size, emit_chunks=True).records:
                match record:
                    case Chunk():
                        yield from breakup_chunk(_unpacked(path, record), validate_crc=True)
                    case _:
                        yield record
    except InputError:
        raise
    except Exception as error:  # errors of struct, both compressors, text and memory, beside those of the library
        cut = "it ends too early (if a recorder was cut off, 'mcap recover' of the MCAP project saves what there is)"
        reason = cut if isinstance(error, EndOfFile | struct.error) else _reason(error)
        raise InputError(f"{path}: no MCAP file, or damaged: {reason}") from error


def _unpacked(path: Path, chunk: Chunk) -> Chunk:
    """Return the chunk without compression. InputError: it is larger than it says, or than any recorder makes it."""
    size = len(chunk.data) if chunk.compression not in _UNPACK else chunk.uncompressed_size
    if size > _CHUNK:
        raise InputError(f"{path}: a chunk of {size} bytes, where {_CHUNK} are read at most")
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
"""By the name of a compression: what unpacks so many bytes at most."""


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
    except Exception as error:  # as above: parsers of schemas raise undocumented errors
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
