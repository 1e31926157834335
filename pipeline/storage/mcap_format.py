"""Logs as bytes of MCAP files, and back: the only file that writes MCAP.

Messages are flat JSON objects of numbers with a JSON schema, so that any MCAP viewer can plot them.
"""

import json
import math
from collections.abc import Iterator, Mapping
from io import BytesIO
from typing import Any

import numpy as np
from mcap.records import Attachment, Channel, Chunk, Header, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.writer import CompressionType, Writer
from zstandard import frame_content_size

from pipeline.storage.documents import KNOWN, Documents
from pipeline.storage.series import LIBRARY, TIME, Log, Series
from trackably.files import from_json

_FORMAT = "1"
_JSON = "application/json"
_COMPRESSIONS = {"": CompressionType.NONE, "zstd": CompressionType.ZSTD}
_COMPACT = json.JSONEncoder(allow_nan=False, separators=(",", ":"))


def encode(log: Log, compression: CompressionType = CompressionType.ZSTD) -> bytes:
    """Return the bytes of an MCAP file; equal logs give equal bytes with the same version of the compressor.

    Names of fields and digits of times fill most of a message: compressed, a log has less than half of its size.
    """
    buffer = BytesIO()
    writer = Writer(buffer, compression=compression, enable_data_crcs=True)
    writer.start(library=LIBRARY)
    for record, content in {LIBRARY: {"format": _FORMAT}, **log.metadata}.items():
        writer.add_metadata(record, dict(content))
    for name, data in log.attachments.items():
        writer.add_attachment(create_time=0, log_time=0, name=name, media_type=_JSON, data=data)
    channels = [_register(writer, series) for series in log.series]
    messages = [
        (nanoseconds, channel, row, data)
        for channel, series in zip(channels, log.series, strict=True)
        for row, (nanoseconds, data) in enumerate(_messages(series))
    ]
    for documents in log.documents:
        channel = _register_schema(writer, documents.topic, documents.name, documents.schema)
        messages += [
            (time, channel, row, _COMPACT.encode(message).encode())
            for row, (time, message) in enumerate(documents.messages)
        ]
    for nanoseconds, channel, row, data in sorted(messages):
        writer.add_message(channel, nanoseconds, data, publish_time=nanoseconds, sequence=row)
    writer.finish()  # type: ignore[no-untyped-call]
    return buffer.getvalue()


def _register(writer: Writer, series: Series) -> int:
    """Register the channel of a series and its schema, and return the channel's number."""
    properties = {TIME: {"type": "number", "description": "s"}}
    for name in series.fields:
        unit = {"description": series.units[name]} if name in series.units else {}
        properties[name] = {"type": "number", **unit}
    schema = {"type": "object", "properties": properties, "required": [TIME], "additionalProperties": False}
    return _register_schema(writer, series.topic, series.topic[1:], schema)


def _register_schema(writer: Writer, topic: str, name: str, schema: Mapping[str, Any]) -> int:
    data = json.dumps(schema, ensure_ascii=False).encode()
    number = writer.register_schema(name=name, encoding="jsonschema", data=data)
    return writer.register_channel(topic=topic, message_encoding="json", schema_id=number)


def _messages(series: Series) -> Iterator[tuple[int, bytes]]:
    """Yield the time [ns] and the content of each row."""
    names = (TIME, *series.fields)
    columns = (series.times, *series.fields.values())
    for row in zip(*(column.tolist() for column in columns), strict=True):
        content = {name: value for name, value in zip(names, row, strict=True) if not math.isnan(value)}
        yield round(row[0] * 1e9), _COMPACT.encode(content).encode()


def decode(data: bytes) -> Log:
    """Return the log in the bytes of a file. Raises what the MCAP library raises, and ValueError for other mistakes."""
    schemas: dict[int, Schema] = {}
    channels: dict[int, Channel] = {}
    messages: dict[int, list[Message]] = {}
    metadata: dict[str, dict[str, str]] = {}
    attachments: dict[str, bytes] = {}
    for record in _records(data):
        match record:
            case Header() if record.library != LIBRARY:
                raise ValueError(f"its writer calls itself {record.library!r}, not {LIBRARY!r}")
            case Schema():
                schemas[record.id] = record
            case Channel():
                channels[record.id] = record
            case Message():
                messages.setdefault(record.channel_id, []).append(record)
            case Metadata():
                metadata[record.name] = record.metadata
            case Attachment():
                attachments[record.name] = record.data
    if (version := metadata.pop(LIBRARY, {}).get("format")) != _FORMAT:
        raise ValueError(f"its format is {version!r}, and this program reads format {_FORMAT!r}")
    if unknown := messages.keys() - channels.keys():
        raise ValueError(f"it has messages of channel {min(unknown)}, which it does not describe")
    series, documents = [], []
    for id_, channel in sorted(channels.items()):
        schema = _schema(channel, schemas)
        if schema.name.startswith(KNOWN):
            documents.append(_documents(channel.topic, schema, messages.get(id_, [])))
        else:
            series.append(_series(channel.topic, schema, messages.get(id_, [])))
    return Log(tuple(series), metadata, attachments, tuple(documents))


def _records(data: bytes) -> Iterator[McapRecord]:
    """Yield all records in the order of the file, and check the library's checksums."""
    for record in StreamReader(BytesIO(data), emit_chunks=True, validate_crcs=True).records:
        if not isinstance(record, Chunk):
            yield record
            continue
        if record.compression not in _COMPRESSIONS:
            raise ValueError(f"a chunk is compressed with {record.compression!r}, and this project uses zstd")
        if record.compression and frame_content_size(record.data) != record.uncompressed_size:
            raise ValueError("a chunk has another size than it says")  # before memory is taken for it
        yield from breakup_chunk(record, validate_crc=True)


def compression_of(data: bytes) -> CompressionType:
    """Return how the chunks of a file are compressed. Raises as `decode`."""
    chunks = (record for record in StreamReader(BytesIO(data), emit_chunks=True).records if isinstance(record, Chunk))
    return next((_COMPRESSIONS[chunk.compression] for chunk in chunks), CompressionType.ZSTD)


def _schema(channel: Channel, schemas: Mapping[int, Schema]) -> Schema:
    if channel.schema_id not in schemas:
        raise ValueError(f"{channel.topic}: there is no schema {channel.schema_id}")
    schema = schemas[channel.schema_id]
    if (encodings := (channel.message_encoding, schema.encoding)) != ("json", "jsonschema"):
        raise ValueError(f"{channel.topic}: encodings must be json and jsonschema, got {' and '.join(encodings)}")
    return schema


def _documents(topic: str, schema: Schema, messages: list[Message]) -> Documents:
    described = from_json(schema.data)
    if not isinstance(described, dict):
        raise ValueError(f"{topic}: the schema describes no object")
    return Documents(topic, schema.name, described, tuple((m.log_time, _object(topic, m)) for m in messages))


def _object(topic: str, message: Message) -> dict[str, Any]:
    content = from_json(message.data)
    if not isinstance(content, dict):
        raise ValueError(f"{topic}: a message must be an object, got {content!r}")
    return content


def _series(topic: str, schema: Schema, messages: list[Message]) -> Series:
    properties = _properties(topic, from_json(schema.data))
    rows = [_row(f"{topic}[{i}]", message.data, properties) for i, message in enumerate(messages)]
    columns = {name: np.array([row.get(name, np.nan) for row in rows], dtype=float) for name in properties}
    units = {name: unit for name, unit in properties.items() if name != TIME and unit is not None}
    return Series(topic, columns.pop(TIME), columns, units)


def _properties(topic: str, schema: object) -> dict[str, str | None]:
    """Return the unit of each field that a schema allows."""
    match schema:
        case {"properties": {"t": _, **_rest} as properties}:
            return {name: about.get("description") for name, about in properties.items() if isinstance(about, dict)}
    raise ValueError(f"{topic}: the schema describes no object with a time {TIME!r}")


def _row(where: str, data: bytes, properties: Mapping[str, str | None]) -> dict[str, float]:
    row = from_json(data)
    if not isinstance(row, dict) or TIME not in row:
        raise ValueError(f"{where}: a message must be an object with a time {TIME!r}, got {row!r}")
    if unknown := row.keys() - properties.keys():
        raise ValueError(f"{where}: the schema knows no field {', '.join(sorted(unknown))}")
    for name, value in row.items():
        if not isinstance(value, float):
            raise ValueError(f"{where}: {name} must be a number with a point or exponent, got {value!r}")
    return row
