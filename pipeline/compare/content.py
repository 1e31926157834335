"""Artifacts as values at places, and the judgement on two collections of them: JSON, CSV, logs and notebooks.

Text is taken apart: words have to stay, and numbers may move within tolerance."""

import csv
import json
import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from hashlib import sha256
from io import StringIO
from pathlib import Path

from pipeline.compare.model import ABSENT, Difference, Found, Row, Status, Tolerances, Value
from pipeline.storage.logs import TIME, Documents, Log, LogError, Series, read_log

_SHOWN = 5


class UnreadableError(Exception):
    """An artifact is not of the format that its name promises; the message says why, without naming the file."""


@dataclass(frozen=True, slots=True)
class Leaf:
    """A single value; rules know it by its `field`."""

    field: str
    value: Value


Leaves = Mapping[str, Leaf]
"""Values by place, in the order of the artifact."""


@dataclass(frozen=True)
class Part:
    """The values of one row of a comparison on both sides; None where a side does not have them.

    `notes` are remarks for the reader.
    """

    topic: str
    field: str
    base: Leaves | None
    new: Leaves | None
    notes: tuple[str, ...] = ()


def judge(artifact: str, part: Part, tolerances: Tolerances) -> Row:
    """Judge a part by the tolerances, and return its row."""
    if part.base is None or part.new is None:
        status = Status.EXTRA if part.base is None else Status.MISSING
        return Row(artifact, part.topic, part.field, status, notes=part.notes)
    differences, left_out = [], set()
    rule_of = tolerances.rules_for(artifact, part.topic)
    for place, base, new, field in _pairs(part.base, part.new):
        if _same(base, new):
            continue
        rule = rule_of(field)
        if rule.ignore:
            left_out.add(rule.name)
        else:
            differences.append(Difference(place, base, new, rule))
    # There may be a million of them: each is measured once.
    excess = [difference.excess for difference in differences]
    beyond = sum(of > 1 for of in excess)
    notes = part.notes + tuple(f"not compared, by rule {name!r}: some values that differ" for name in sorted(left_out))
    return Row(
        artifact,
        part.topic,
        part.field,
        _status(bool(beyond), bool(differences or left_out)),
        tuple(differences[i] for i in sorted(range(len(excess)), key=lambda i: -excess[i])[:_SHOWN]),
        compared=len(part.base.keys() | part.new.keys()),
        differing=len(differences),
        beyond=beyond,
        notes=notes,
    )


def _status(beyond: bool, differs: bool) -> Status:
    return Status.DIFFERENT if beyond else Status.WITHIN if differs else Status.IDENTICAL


def _pairs(base: Leaves, new: Leaves) -> list[tuple[str, Found, Found, str]]:
    """Return place, both values and field; places that only `new` has come last."""
    shared = [
        (place, leaf.value, new[place].value if place in new else ABSENT, leaf.field) for place, leaf in base.items()
    ]
    return shared + [(place, ABSENT, leaf.value, leaf.field) for place, leaf in new.items() if place not in base]


def _same(base: Found, new: Found) -> bool:
    if isinstance(base, bool) or isinstance(new, bool):
        return base is new
    if isinstance(base, float) and isinstance(new, float) and math.isnan(base):
        return math.isnan(new)
    return base == new


_NUMBER = re.compile(r"(?<![\w.])[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?(?![\w.])")


def prose_leaves(place: str, text: str, words: str, numbers: str) -> Iterator[tuple[str, Leaf]]:
    """Yield the text without its numbers as a value of the field `words`, and each number as one of `numbers`."""
    plain = text.replace("−", "-")  # as figures write it
    yield place, Leaf(words, _NUMBER.sub("#", plain))
    for i, number in enumerate(_NUMBER.findall(plain), start=1):
        yield f"{place}, number {i}", Leaf(numbers, float(number))


def read_json(data: bytes) -> object:
    """Read JSON with NaN and infinities: a comparison has to say where they are. Raises UnreadableError."""
    try:
        content: object = json.loads(data.decode())
    except (ValueError, RecursionError) as error:
        raise UnreadableError(f"no JSON: {error}") from error
    return content


def json_leaves(content: object) -> Leaves:
    """Return every value by its path: `sound.tail.start`, `weights[3]`."""
    return {path: Leaf(path, value) for path, value in _walk(content, "")}


def told_leaves(content: object) -> Leaves:
    """Return the same, with sentences taken apart: the words are at `proof`, its numbers at `proof, number 1` …"""
    leaves: dict[str, Leaf] = {}
    for path, leaf in json_leaves(content).items():
        sentence = isinstance(leaf.value, str) and " " in leaf.value
        leaves.update(prose_leaves(path, str(leaf.value), path, path) if sentence else {path: leaf})
    return leaves


def _walk(content: object, path: str) -> Iterator[tuple[str, Value]]:
    match content:
        case dict() if content:
            for key, value in content.items():
                yield from _walk(value, f"{path}.{key}" if path else str(key))
        case list() if content:
            for i, value in enumerate(content):
                yield from _walk(value, f"{path}[{i}]")
        case dict() | list():
            yield path, "empty"
        case float() | int() | str() | bool() | None:
            yield path, content


def json_parts(base: object, new: object) -> list[Part]:
    """Return one part, whose places are paths."""
    return [Part("", "", told_leaves(base), told_leaves(new))]


@dataclass(frozen=True)
class CsvTable:
    """A header, and rows of text that have its length."""

    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def read_csv(data: bytes) -> CsvTable:
    """Read a table. Raises UnreadableError where the header repeats a name, or a row has another length."""
    try:
        lines = [tuple(row) for row in csv.reader(StringIO(data.decode(), newline=""), strict=True)]
    except (UnicodeDecodeError, csv.Error) as error:
        raise UnreadableError(f"no CSV table: {error}") from error
    if not lines or len(set(lines[0])) != len(lines[0]):
        raise UnreadableError("no CSV table: the first line has to name the columns, each once")
    for number, line in enumerate(lines[1:], start=2):
        if len(line) != len(lines[0]):
            raise UnreadableError(f"line {number} has {len(line)} cells below a header of {len(lines[0])}")
    return CsvTable(lines[0], tuple(lines[1:]))


def csv_parts(base: CsvTable, new: CsvTable) -> list[Part]:
    """Return one part, whose places are column and line."""
    return [Part("", "", _table_leaves(base), _table_leaves(new))]


def _table_leaves(table: CsvTable) -> Leaves:
    return {
        f"column {column}, line {number}": Leaf(column, _csv_cell(cell))
        for number, row in enumerate(table.rows, start=2)
        for column, cell in zip(table.columns, row, strict=True)
    }


def _csv_cell(text: str) -> Value:
    """Return a number where the cell holds one, None where it is empty."""
    if not text:
        return None
    try:
        number = float(text)
    except ValueError:
        return text
    return int(number) if math.isfinite(number) and number.is_integer() and abs(number) < 2**53 else number


def numbers_of(table: CsvTable) -> dict[str, list[float]]:
    """Return the cells by column; NaN where a cell is not a number."""
    columns = {name: [_csv_cell(row[i]) for row in table.rows] for i, name in enumerate(table.columns)}
    return {
        name: [float(cell) if isinstance(cell, int | float) else math.nan for cell in cells]
        for name, cells in columns.items()
    }


def read_recording(path: Path) -> Log:
    """Read a log and check every bit of it. Raises UnreadableError."""
    return _read_once(path, sha256(path.read_bytes()).digest())


@lru_cache(maxsize=4)
def _read_once(path: Path, content: bytes) -> Log:
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
        yield Part(f"attachment {name}", "", _attached(base, name), _attached(new, name))
    yield Part("metadata", "", _about(base), _about(new))


def _series_parts(base: Series, new: Series) -> Iterator[Part]:
    counts = len(base.times), len(new.times)
    rows = _places(base), _places(base if counts[0] == counts[1] else new)
    notes = () if counts[0] == counts[1] else (f"{counts[0]} samples in BASE, {counts[1]} in NEW",)
    fields = {TIME: base.times, **base.fields}, {TIME: new.times, **new.fields}
    for field in {**fields[0], **fields[1]}:
        columns = [
            {place: Leaf(field, value) for place, value in zip(places, side[field].tolist(), strict=True)}
            if field in side
            else None
            for places, side in zip(rows, fields, strict=True)
        ]
        yield Part(base.topic, field, columns[0], columns[1], notes)


def _places(series: Series) -> list[str]:
    """Name samples by their time, and also by their number where several have the same time."""
    times = series.times.tolist()
    often = Counter(times)
    return [f"t = {t!r} s" + (f", sample {i}" if often[t] > 1 else "") for i, t in enumerate(times)]


def _messages(documents: Documents) -> Leaves:
    """Return the values in all messages, by the number of the message and the path in it."""
    return told_leaves({"messages": [{"time": time, **message} for time, message in documents.messages]})


def _attached(log: Log, name: str) -> Leaves | None:
    return told_leaves(read_json(log.attachments[name])) if name in log.attachments else None


def _about(log: Log) -> Leaves:
    """Return metadata records and units."""
    return json_leaves(
        {**_plain(log.metadata), "unit": {series.topic: dict(series.units) for series in log.series if series.units}}
    )


def _plain(metadata: Mapping[str, Mapping[str, str]]) -> dict[str, object]:
    return {record: dict(content) for record, content in metadata.items()}
