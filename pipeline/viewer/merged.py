"""Several logs as one: viewers of one file show all topics of an experiment side by side."""

from collections.abc import Iterator, Sequence
from io import BytesIO
from pathlib import Path

from mcap.reader import make_reader
from mcap.records import Channel, Message, Schema
from mcap.writer import CompressionType, Writer

from pipeline.storage.logs import DAMAGES, LogError

_CHUNK = 2**16
"""Bytes: viewers load a log in pieces of time, and read all chunks that such a piece touches."""


def merged(paths: Sequence[Path]) -> bytes:
    """Return an MCAP file with the messages of all logs in the order of time; attachments are left out.

    Raises LogError where a log cannot be read.
    """
    buffer = BytesIO()
    writer = Writer(buffer, chunk_size=_CHUNK, compression=CompressionType.NONE)
    writer.start(library="trackably")
    channels: dict[tuple[Path, int], int] = {}
    for path, schema, channel, message in sorted(_messages(paths), key=lambda found: found[-1].log_time):
        key = path, channel.id
        if key not in channels:
            number = writer.register_schema(schema.name, schema.encoding, schema.data)
            channels[key] = writer.register_channel(channel.topic, channel.message_encoding, number)
        writer.add_message(channels[key], message.log_time, message.data, message.publish_time, message.sequence)
    writer.finish()  # type: ignore[no-untyped-call]
    return buffer.getvalue()


def _messages(paths: Sequence[Path]) -> Iterator[tuple[Path, Schema, Channel, Message]]:
    for path in paths:
        try:
            with path.open("rb") as file:
                for schema, channel, message in make_reader(file).iter_messages(log_time_order=False):
                    if schema is None:
                        raise LogError(f"{path}: {channel.topic} has no schema")
                    yield path, schema, channel, message
        except DAMAGES as error:
            raise LogError(f"{path}: not a log of this project, or damaged: {error}") from error
