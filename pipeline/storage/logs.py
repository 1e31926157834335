"""Write and read the logs of an experiment as MCAP files: series of numbers over time.

Equal logs are equal files. So damage is found by encoding again the log that was read, and comparing the bytes.
Messages of a series are flat JSON objects of numbers with a JSON schema, so that any MCAP viewer can plot them."""

import json
import math
import struct
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from io import BytesIO
from pathlib import Path
from typing import Any, Self, TypeVar

import numpy as np
from mcap.records import Attachment, Channel, McapRecord, Message, Metadata, Schema
from mcap.writer import CompressionType, Writer

from trackably.arrays import Array
from trackably.errors import InputError
from trackably.files import from_json, read_bytes, write_atomically
from trackably.recordings.mcap_file import records_in

T = TypeVar("T")
LIBRARY = "trackably"
TIME = "t"


@dataclass(frozen=True)
class Series:
    """A topic: `fields` over `times` [s], each of shape (n,), float64; NaN where a field has no value.

    Times are finite, not negative and never decrease.
    """

    topic: str
    times: Array
    fields: Mapping[str, Array]

    @property
    def schema(self) -> dict[str, Any]:
        """The JSON schema of the messages."""
        if TIME in self.fields:
            raise ValueError(f"{self.topic}: a field has another name than {TIME!r}, the name of the time: rename it")
        properties: dict[str, Any] = {TIME: {"type": "number", "description": "s"}}
        properties |= {name: {"type": "number"} for name in self.fields}
        return {"type": "object", "properties": properties, "required": [TIME], "additionalProperties": False}

    @property
    def messages(self) -> Iterator[dict[str, float]]:
        """The messages, one for each row, with the time and the fields that have a value."""
        columns = {TIME: self.times, **self.fields}
        for row in zip(*(np.asarray(column, dtype=float).tolist() for column in columns.values()), strict=True):
            yield {name: value for name, value in zip(columns, row, strict=True) if not math.isnan(value)}

    @classmethod
    def of(cls, topic: str, schema: Mapping[str, Any], messages: Sequence[Mapping[str, Any]]) -> Self:
        """Return the series with this schema and these messages."""
        names = schema["properties"]
        columns = {name: np.array([of.get(name, np.nan) for of in messages], dtype=float) for name in names}
        return cls(topic, columns.pop(TIME), columns)


@dataclass(frozen=True)
class Log:
    """Series of different topics, `metadata` (record → key → text) and `attachments` (name → JSON, at least one).

    The writer adds a metadata record of its own, with the name of the library.
    """

    series: tuple[Series, ...]
    metadata: Mapping[str, Mapping[str, str]]
    attachments: Mapping[str, bytes]


_FORMAT = "1"
_CHUNK_SIZE = 1024 * 1024  # bytes of a chunk before compression
_JSON = "application/json"
_COMPACT = json.JSONEncoder(allow_nan=False, separators=(",", ":"))


def encode(log: Log) -> bytes:
    """Return the bytes of an MCAP file; equal logs give equal bytes with the same version of the compressor.

    Compression more than halves the size, because most bytes of messages are names of fields and digits of times.
    """
    buffer = BytesIO()
    writer = Writer(buffer, _CHUNK_SIZE, compression=CompressionType.ZSTD, enable_data_crcs=True)
    writer.start(library=LIBRARY)
    for record, content in {LIBRARY: {"format": _FORMAT}, **log.metadata}.items():
        writer.add_metadata(record, dict(content))
    for name, data in log.attachments.items():
        writer.add_attachment(create_time=0, log_time=0, name=name, media_type=_JSON, data=data)
    messages: list[tuple[int, int, int, bytes]] = []
    for series in log.series:
        schema = json.dumps(series.schema, ensure_ascii=False).encode()
        number = writer.register_schema(name=series.topic[1:], encoding="jsonschema", data=schema)
        channel = writer.register_channel(topic=series.topic, message_encoding="json", schema_id=number)
        messages += [
            (round(message[TIME] * 1e9), channel, row, _COMPACT.encode(message).encode())
            for row, message in enumerate(series.messages)
        ]
    for time, channel, row, data in sorted(messages):
        writer.add_message(channel, time, data, publish_time=time, sequence=row)
    writer.finish()  # type: ignore[no-untyped-call]
    return buffer.getvalue()


def decode(records: Iterable[McapRecord]) -> Log:
    """Return the log of the records of a file, which is right if encoding it gives the same bytes.

    Raises ValueError, LookupError, TypeError or AttributeError if they hold none.
    """
    found: dict[type, list[Any]] = defaultdict(list)
    for record in records:
        found[type(record)].append(record)
    metadata = {record.name: record.metadata for record in found[Metadata]}
    if (version := metadata.pop(LIBRARY, {}).get("format")) != _FORMAT:
        raise ValueError(f"its format is {version!r}, and this program reads format {_FORMAT!r}; run its stage again")
    schemas = {record.id: record for record in found[Schema]}
    messages: dict[int, list[dict[str, Any]]] = defaultdict(list)
    for record in found[Message]:
        messages[record.channel_id].append(_object(record.data))
    series = tuple(
        Series.of(channel.topic, _object(schemas[channel.schema_id].data), messages[number])
        for number, channel in sorted({record.id: record for record in found[Channel]}.items())
    )
    return Log(series, metadata, {record.name: record.data for record in found[Attachment]})


def _object(data: bytes) -> dict[str, Any]:
    content = from_json(data)
    if not isinstance(content, dict):
        raise TypeError(f"expected an object, got {content!r}")
    return content


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
    return _decoded(path, read_bytes(path))


@lru_cache(maxsize=8)  # a stage looks up several things in the same few logs
def _decoded(path: Path, data: bytes) -> Log:
    try:
        log = decode(records_in(path))
        again = encode(log)
    except (LookupError, TypeError, AttributeError, ValueError, OverflowError, struct.error) as error:
        raise InputError(f"{path}: not a log of this project: {error!r}") from error
    if again != data:
        raise InputError(
            f"{path}: damaged, or written by another program or another version of this one; run its stage again"
        )
    return log


def below(topics: Mapping[str, T], *path: str) -> dict[str, T]:
    """Return what belongs to the topics `/path/…` by the rest of their names, which is '' for the topic `/path`."""
    start = "".join(f"/{part}" for part in path)
    return {
        name.removeprefix(start).removeprefix("/"): of
        for name, of in topics.items()
        if f"{name}/".startswith(f"{start}/")
    }
