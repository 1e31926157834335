"""Logs of time series: the only file that knows MCAP.

Messages are flat JSON objects of numbers with a JSON schema, so that any MCAP viewer can plot them. Equal logs are
equal files, byte for byte, and this is also how damage is found: see `read_log`.
"""

import json
import math
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path

import numpy as np
from mcap.exceptions import EndOfFile, McapError
from mcap.records import Attachment, Channel, Chunk, Header, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.writer import CompressionType, Writer

from trackable.arrays import Array
from trackable.files import from_json, write_atomically

LIBRARY = "trackable"
FORMAT = "1"
TIME = "t"
JSON = "application/json"
LATEST = 2**63 / 1e9
"""The first time [s] whose nanoseconds no longer fit the signed 64 bits that most viewers have for them."""


class LogError(Exception):
    """A file is not, or no longer, a log as this module writes it."""


@dataclass(frozen=True)
class Series:
    """One topic: `fields` over `times` [s], each of shape (n,), float64; NaN where a field has no value.

    Times are finite, not negative and never decrease. A field is named by an identifier other than `t`, or by several
    with dots between them; `units` says the unit of some or all. Raises ValueError naming topic, field and row.
    """

    topic: str
    times: Array
    fields: Mapping[str, Array]
    units: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not (self.topic.startswith("/") and len(self.topic) > 1):
            raise ValueError(f"series: a topic is /… with a name, got {self.topic!r}")
        for name in self.fields:
            if name == TIME or not all(part.isidentifier() for part in name.split(".")):
                raise ValueError(f"{self.topic}: a field is named by identifiers, and not {TIME!r}, got {name!r}")
        if unknown := self.units.keys() - self.fields.keys():
            raise ValueError(f"{self.topic}: units of no field: {', '.join(sorted(unknown))}")
        times = _frozen(self.times)
        fields = {name: _frozen(values) for name, values in self.fields.items()}
        for name, array in {TIME: times, **fields}.items():
            if array.ndim != 1 or array.shape != times.shape:
                raise ValueError(
                    f"{self.topic}: {name} must be one-dimensional, as long as the times, "
                    f"got shape {array.shape} beside {times.shape}"
                )
            if bad := np.flatnonzero(np.isinf(array)).tolist():
                raise ValueError(f"{self.topic}: {name}[{bad[0]}] must be finite or NaN, got {array[bad[0]]}")
        if bad := np.flatnonzero(~((times >= 0) & (times < LATEST))).tolist():
            raise ValueError(f"{self.topic}: {TIME}[{bad[0]}] must be in [0, {LATEST:g}) s, got {times[bad[0]]}")
        if bad := np.flatnonzero(np.diff(times) < 0).tolist():
            raise ValueError(f"{self.topic}: {TIME}[{bad[0] + 1}] lies before {TIME}[{bad[0]}]")
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "fields", fields)


@dataclass(frozen=True)
class Log:
    """Series of distinct topics, `metadata` (record → key → text) and `attachments` (name → JSON, at least one).

    The metadata record named as the library is the writer's own. Raises ValueError naming what breaks a rule.
    """

    series: tuple[Series, ...]
    metadata: Mapping[str, Mapping[str, str]]
    attachments: Mapping[str, bytes]

    def __post_init__(self) -> None:
        topics = [series.topic for series in self.series]
        if repeated := sorted({topic for topic in topics if topics.count(topic) > 1}):
            raise ValueError(f"log: one series a topic, got several of {', '.join(repeated)}")
        if LIBRARY in self.metadata:
            raise ValueError(f"log: the metadata record {LIBRARY!r} is written by the log itself")
        if not self.attachments:
            raise ValueError("log: at least one attachment is needed, got none")
        for name, data in self.attachments.items():
            try:
                from_json(data)
            except ValueError as error:
                raise ValueError(f"log: attachment {name!r} must be JSON: {error}") from error


def write_log(path: Path, log: Log) -> None:
    """The log as a file, whole or not at all; equal logs give equal bytes."""
    write_atomically(path, _encode(log))


def read_log(path: Path) -> Log:
    """The log in a file, every float64 as it was written. OSError where there is no file to read.

    Checksums do not cover an MCAP file wholly: an index or a header may be damaged unseen. So what was read is written
    again, and the bytes are compared. Any bit that differs, anywhere, ends in one LogError that names the file. So does
    a file from another program, or from a release of the library that lays files out in another way: such a file may
    be sound, but is not one this pipeline wrote.
    """
    data = path.read_bytes()
    try:
        log = _decode(data)
    except (McapError, struct.error, ValueError, LookupError, OverflowError) as error:
        raise LogError(f"{path}: not a log of this project, or damaged: {_reason(error)}") from error
    again = _encode(log)
    if again != data:
        pairs = enumerate(zip(again, data, strict=False))
        at = next((i for i, (expected, found) in pairs if expected != found), min(len(again), len(data)))
        raise LogError(f"{path}: damaged, or written by another program: byte {at} is not what its content gives")
    return log


def _reason(error: Exception) -> str:
    if isinstance(error, EndOfFile | struct.error):
        return "it ends in the middle of a record"
    return str(error) or type(error).__name__


def _frozen(values: Array) -> Array:
    array = np.array(values, dtype=float)
    array.flags.writeable = False
    return array


def _encode(log: Log) -> bytes:
    buffer = BytesIO()
    # A compressor may change its output with its version; without one the bytes depend on the log alone.
    writer = Writer(buffer, compression=CompressionType.NONE, enable_data_crcs=True)
    writer.start(library=LIBRARY)
    for record, content in {LIBRARY: {"format": FORMAT}, **log.metadata}.items():
        writer.add_metadata(record, dict(content))
    for name, data in log.attachments.items():
        writer.add_attachment(create_time=0, log_time=0, name=name, media_type=JSON, data=data)
    channels = [_register(writer, series) for series in log.series]
    messages = [
        (nanoseconds, channel, row, data)
        for channel, series in zip(channels, log.series, strict=True)
        for row, (nanoseconds, data) in enumerate(_messages(series))
    ]
    for nanoseconds, channel, row, data in sorted(messages):
        writer.add_message(channel, nanoseconds, data, publish_time=nanoseconds, sequence=row)
    writer.finish()  # type: ignore[no-untyped-call]
    return buffer.getvalue()


def _register(writer: Writer, series: Series) -> int:
    """The channel of a series, with its schema."""
    properties = {TIME: {"type": "number", "description": "s"}}
    for name in series.fields:
        unit = {"description": series.units[name]} if name in series.units else {}
        properties[name] = {"type": "number", **unit}
    schema = {"type": "object", "properties": properties, "required": [TIME], "additionalProperties": False}
    data = json.dumps(schema, ensure_ascii=False).encode()
    return writer.register_channel(
        topic=series.topic,
        message_encoding="json",
        schema_id=writer.register_schema(name=series.topic[1:], encoding="jsonschema", data=data),
    )


def _messages(series: Series) -> Iterator[tuple[int, bytes]]:
    """Time [ns] and content of each row."""
    names = (TIME, *series.fields)
    columns = (series.times, *series.fields.values())
    for row in zip(*(column.tolist() for column in columns), strict=True):
        content = {name: value for name, value in zip(names, row, strict=True) if not math.isnan(value)}
        yield round(row[0] * 1e9), json.dumps(content, allow_nan=False, separators=(",", ":")).encode()


def _decode(data: bytes) -> Log:
    """The log in `data`; what the library or this module finds wrong is raised as it comes."""
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
    if (version := metadata.pop(LIBRARY, {}).get("format")) != FORMAT:
        raise ValueError(f"its format is {version!r}, and this program reads format {FORMAT!r}")
    if unknown := messages.keys() - channels.keys():
        raise ValueError(f"it has messages of channel {min(unknown)}, which it does not describe")
    series = [_series(channel, schemas, messages.get(id_, [])) for id_, channel in sorted(channels.items())]
    return Log(tuple(series), metadata, attachments)


def _records(data: bytes) -> Iterator[McapRecord]:
    """All records in the order of the file, the library's checksums checked on the way."""
    for record in StreamReader(BytesIO(data), emit_chunks=True, validate_crcs=True).records:
        if not isinstance(record, Chunk):
            yield record
        elif record.compression:
            raise ValueError(f"a chunk is compressed ({record.compression!r}), and this project compresses none")
        else:
            yield from breakup_chunk(record, validate_crc=True)


def _series(channel: Channel, schemas: Mapping[int, Schema], messages: list[Message]) -> Series:
    if channel.schema_id not in schemas:
        raise ValueError(f"{channel.topic}: there is no schema {channel.schema_id}")
    schema = schemas[channel.schema_id]
    if (encodings := (channel.message_encoding, schema.encoding)) != ("json", "jsonschema"):
        raise ValueError(f"{channel.topic}: encodings must be json and jsonschema, got {' and '.join(encodings)}")
    properties = _properties(channel.topic, from_json(schema.data))
    rows = [_row(f"{channel.topic}[{i}]", message.data, properties) for i, message in enumerate(messages)]
    columns = {name: np.array([row.get(name, np.nan) for row in rows], dtype=float) for name in properties}
    units = {name: unit for name, unit in properties.items() if name != TIME and unit is not None}
    return Series(channel.topic, columns.pop(TIME), columns, units)


def _properties(topic: str, schema: object) -> dict[str, str | None]:
    """Each field that a schema allows, and its unit."""
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
