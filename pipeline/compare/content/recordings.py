"""Read logs as values at places: a part for each topic and field, for each attachment, and for the metadata."""

from collections import Counter
from collections.abc import Iterator, Mapping
from functools import lru_cache
from hashlib import sha256
from pathlib import Path

from pipeline.compare.content.documents import json_leaves, read_json, told_leaves
from pipeline.compare.content.values import Leaf, Leaves, Part, UnreadableError
from pipeline.storage.logs import TIME, Documents, Log, LogError, Series, read_log


def read_recording(path: Path) -> Log:
    """Read a log and check every bit of it. Raises UnreadableError."""
    return _read(path, sha256(path.read_bytes()).digest())


@lru_cache(maxsize=4)
def _read(path: Path, content: bytes) -> Log:
    """Claims and certificates look up one value after the other in the same logs, whose `content` is a digest."""
    try:
        return read_log(path)
    except LogError as error:
        raise UnreadableError(str(error).removeprefix(f"{path}: ")) from error


def recording_parts(base: Log, new: Log) -> Iterator[Part]:
    """Yield the parts in the order of `base`; a topic that one side lacks is one part, whatever its fields."""
    series = {s.topic: s for s in base.series}, {s.topic: s for s in new.series}
    for topic in {**series[0], **series[1]}:
        if topic in series[0] and topic in series[1]:
            yield from _series_parts(series[0][topic], series[1][topic])
        else:
            yield Part(topic, "", {} if topic in series[0] else None, {} if topic in series[1] else None)
    documents = {d.topic: d for d in base.documents}, {d.topic: d for d in new.documents}
    for topic in {**documents[0], **documents[1]}:
        sides = [_messages(side[topic]) if topic in side else None for side in documents]
        yield Part(topic, "", sides[0], sides[1])
    for name in {**base.attachments, **new.attachments}:
        yield Part(f"attachment {name}", "", _attachment(base, name), _attachment(new, name))
    yield Part("metadata", "", _about(base), _about(new))


def _series_parts(base: Series, new: Series) -> Iterator[Part]:
    rows = (
        (_by_number(base), _by_number(base)) if len(base.times) == len(new.times) else (_by_time(base), _by_time(new))
    )
    notes = (
        () if len(base.times) == len(new.times) else (f"{len(base.times)} samples in BASE, {len(new.times)} in NEW",)
    )
    fields = {TIME: base.times, **base.fields}, {TIME: new.times, **new.fields}
    for field in {**fields[0], **fields[1]}:
        columns = [
            {place: Leaf(field, value) for place, value in zip(places, side[field].tolist(), strict=True)}
            if field in side
            else None
            for places, side in zip(rows, fields, strict=True)
        ]
        yield Part(base.topic, field, columns[0], columns[1], notes)


def _by_number(series: Series) -> list[str]:
    """Name samples by their time, and also by their number where several have the same time."""
    times = series.times.tolist()
    often = Counter(times)
    return [f"t = {t!r} s" + (f", sample {i}" if often[t] > 1 else "") for i, t in enumerate(times)]


def _by_time(series: Series) -> list[str]:
    """Name samples by their time in whole nanoseconds: rounding cannot pair them wrongly."""
    seen: Counter[int] = Counter()
    places = []
    for t in series.times.tolist():
        nanoseconds = round(t * 1e9)
        seen[nanoseconds] += 1
        places.append(
            f"t = {nanoseconds / 1e9!r} s" + (f", number {seen[nanoseconds]}" if seen[nanoseconds] > 1 else "")
        )
    return places


def _messages(documents: Documents) -> Leaves:
    """Return the values in all messages, by the number of the message and the path in it."""
    return told_leaves({"messages": [{"time": time, **message} for time, message in documents.messages]})


def _attachment(log: Log, name: str) -> Leaves | None:
    return told_leaves(read_json(log.attachments[name])) if name in log.attachments else None


def _about(log: Log) -> Leaves:
    """Return metadata records and units."""
    return json_leaves(
        {**_plain(log.metadata), "unit": {series.topic: dict(series.units) for series in log.series if series.units}}
    )


def _plain(metadata: Mapping[str, Mapping[str, str]]) -> dict[str, object]:
    return {record: dict(content) for record, content in metadata.items()}
