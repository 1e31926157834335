"""Write and read the logs of an experiment as MCAP files: series of numbers, and other messages.

Equal logs are equal files. So damage is found by encoding again the log that was read, and comparing the bytes.
Messages of a series are flat JSON objects of numbers with a JSON schema, so that any MCAP viewer can plot them."""

import json
import math
import struct
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from mcap.records import Attachment, Channel, Header, McapRecord, Message, Metadata, Schema
from mcap.writer import CompressionType, Writer

from pipeline.storage.results import Results
from trackably.arrays import Array
from trackably.errors import InputError
from trackably.files import from_json, read_bytes, write_atomically
from trackably.recordings.mcap_file import records_in

KNOWN = "foxglove."
"""The beginning of the names of schemas that viewers know and draw."""


@dataclass(frozen=True)
class Documents:
    """A topic with messages other than numbers over time: pairs (time [ns], JSON object) in the order of time.

    All messages have the JSON `schema` with this `name`.
    """

    topic: str
    name: str
    schema: Mapping[str, Any]
    messages: tuple[tuple[int, Mapping[str, Any]], ...]


LIBRARY = "trackably"
TIME = "t"


@dataclass(frozen=True)
class Series:
    """A topic: `fields` over `times` [s], each of shape (n,), float64; NaN where a field has no value.

    Times are finite, not negative and never decrease. `units` gives the units of some or all fields. ValueError, with
    topic and field: a field has the name of the time, or another length than the times.
    """

    topic: str
    times: Array
    fields: Mapping[str, Array]
    units: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if TIME in self.fields:
            raise ValueError(f"{self.topic}: a field has another name than {TIME!r}, the name of the time: rename it")
        times = _frozen(self.times)
        fields = {name: _frozen(values) for name, values in self.fields.items()}
        for name, array in {TIME: times, **fields}.items():
            if array.ndim != 1 or array.shape != times.shape:
                raise ValueError(
                    f"{self.topic}: {name} must be one-dimensional, as long as the times, "
                    f"got shape {array.shape} for times of shape {times.shape}"
                )
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "fields", fields)


@dataclass(frozen=True)
class Log:
    """Series of different topics, `metadata` (record → key → text) and `attachments` (name → JSON, at least one).

    `documents` are topics of other messages; their channels follow those of the series.

    The writer adds a metadata record of its own, with the name of the library.
    """

    series: tuple[Series, ...]
    metadata: Mapping[str, Mapping[str, str]]
    attachments: Mapping[str, bytes]
    documents: tuple[Documents, ...] = ()


def _frozen(values: Array) -> Array:
    array = np.array(values, dtype=float)
    array.flags.writeable = False
    return array


_FORMAT = "1"
_CHUNK_SIZE = 1024 * 1024  # bytes of a chunk before compression
_JSON = "application/json"
_COMPACT = json.JSONEncoder(allow_nan=False, separators=(",", ":"))


def encode(log: Log, compression: CompressionType = CompressionType.ZSTD, chunk_size: int = _CHUNK_SIZE) -> bytes:
    """Return the bytes of an MCAP file; equal logs give equal bytes with the same version of the compressor.

    Chunks hold about `chunk_size` bytes. Compression more than halves the size, because most bytes of messages are
    names of fields and digits of times.
    """
    buffer = BytesIO()
    writer = Writer(buffer, chunk_size, compression=compression, enable_data_crcs=True)
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


def decode(records: Iterable[McapRecord]) -> Log:
    """Return the log of the records of a file, which is right if encoding it gives the same bytes.

    Raises ValueError, LookupError, TypeError or AttributeError if they hold none.
    """
    schemas: dict[int, Schema] = {}
    channels: dict[int, Channel] = {}
    messages: dict[int, list[Message]] = {}
    metadata: dict[str, dict[str, str]] = {}
    attachments: dict[str, bytes] = {}
    for record in records:
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
        raise ValueError(f"its format is {version!r}, and this program reads format {_FORMAT!r}; run its stage again")
    series, documents = [], []
    for id_, channel in sorted(channels.items()):
        schema = schemas[channel.schema_id]
        described, of = _object(schema.data), messages.get(id_, [])
        if schema.name.startswith(KNOWN):
            contents = tuple((message.log_time, _object(message.data)) for message in of)
            documents.append(Documents(channel.topic, schema.name, described, contents))
        else:
            rows = [_object(message.data) for message in of]
            series.append(_series(channel.topic, described["properties"], rows))
    return Log(tuple(series), metadata, attachments, tuple(documents))


def _object(data: bytes) -> dict[str, Any]:
    content = from_json(data)
    if not isinstance(content, dict):
        raise TypeError(f"expected an object, got {content!r}")
    return content


def _series(topic: str, properties: Mapping[str, Any], rows: list[dict[str, Any]]) -> Series:
    columns = {name: np.array([row.get(name, np.nan) for row in rows], dtype=float) for name in properties}
    units = {name: about["description"] for name, about in properties.items() if "description" in about}
    units.pop(TIME, None)
    return Series(topic, columns.pop(TIME), columns, units)


def write_log(path: Path, log: Log) -> None:
    """Write a log, the whole file or nothing; equal logs give equal bytes."""
    write_atomically(path, encode(log))


def read_log(path: Path) -> Log:
    """Read a log, every float64 as it was written. Raises InputError if it is damaged, or no log of this project.

    Checksums cover only parts of an MCAP file, and would not show damage of an index or a header. So the log that was
    read is encoded again, and the bytes are compared. One bit that differs is an error that names the file. Files of
    another program are refused, too, and files written with another version of the MCAP library or the compressor whose
    output differs: this pipeline did not write them in this form.
    """
    data = read_bytes(path)
    try:
        log = decode(records_in(path))
        again = encode(log)
    except (LookupError, TypeError, AttributeError, ValueError, OverflowError, struct.error) as error:
        raise InputError(f"{path}: not a log of this project: {error!r}") from error
    if again != data:
        raise InputError(f"{path}: damaged, or written by another program: its content gives other bytes")
    return log


@dataclass(frozen=True)
class Topic:
    """A topic of a log: the name of its schema, its fields except the time, and the number of its messages."""

    name: str
    schema: str
    fields: tuple[str, ...]
    rows: int


def logs_of(results: Results) -> tuple[Path, ...]:
    """Return the logs of an experiment. Raises InputError if there are none."""
    found = tuple(sorted(results.folder.glob("*.mcap")))
    if not found:
        raise InputError(f"{results.folder}: there are no logs; run the stages first, or `dvc repro`")
    return found


def topics_of(results: Results) -> dict[str, Topic]:
    """Return the topics of all logs of an experiment by name. Raises InputError."""
    return {topic.name: topic for path in logs_of(results) for topic in _topics(read_log(path))}


def _topics(log: Log) -> Iterator[Topic]:
    for series in log.series:
        yield Topic(series.topic, series.topic[1:], tuple(series.fields), len(series.times))
    for of in log.documents:
        yield Topic(of.topic, of.name, tuple(of.schema["properties"]), len(of.messages))
