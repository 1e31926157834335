"""What topics the logs of an experiment hold, from the summaries of the files."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from mcap.reader import make_reader

from pipeline.storage.logs import DAMAGES, TIME, LogError
from pipeline.storage.results import Results
from trackably.errors import InputError
from trackably.files import from_json


@dataclass(frozen=True)
class Topic:
    """A topic: the name of its schema, its fields but the time, and the number of its messages."""

    name: str
    schema: str
    fields: tuple[str, ...]
    rows: int


def logs_of(results: Results) -> tuple[Path, ...]:
    """Return the logs of an experiment. Raises InputError where there are none."""
    found = tuple(sorted(results.folder.glob("*.mcap")))
    if not found:
        raise InputError(f"{results.folder}: there are no logs; run the stages first, or `dvc repro`")
    return found


def topics_of(results: Results) -> dict[str, Topic]:
    """Return the topics of all logs of an experiment by name. Raises InputError and LogError."""
    return {topic.name: topic for path in logs_of(results) for topic in _topics(path)}


def _topics(path: Path) -> Iterator[Topic]:
    try:
        with path.open("rb") as file:
            summary = make_reader(file).get_summary()
    except DAMAGES as error:
        raise LogError(f"{path}: not a log of this project, or damaged: {error}") from error
    if summary is None or summary.statistics is None:
        raise LogError(f"{path}: has no summary")
    for number, channel in sorted(summary.channels.items()):
        schema = summary.schemas[channel.schema_id]
        match from_json(schema.data):
            case {"properties": {**properties}}:
                fields = tuple(str(name) for name in properties if name != TIME)
            case _:
                fields = ()
        yield Topic(channel.topic, schema.name, fields, summary.statistics.channel_message_counts.get(number, 0))
