"""Read artifacts (JSON, CSV, logs, SVG, notebooks) as values at places, such as `sound.tail.start`, for comparison.

A text becomes its words, which must not change, and its numbers, which may change within tolerance."""

import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from enum import Enum
from hashlib import sha256
from itertools import pairwise
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from pipeline.storage.logs import TIME, Log, read_log
from pipeline.storage.results import read_numbers
from trackably.arrays import Array
from trackably.errors import InputError
from trackably.files import from_json


class UnreadableError(Exception):
    """A file does not have the format of its suffix, or not a value that is looked up; the message says why."""


class Absent(Enum):
    """Stands for a missing value: the other of two compared artifacts has a value at this place."""

    ABSENT = "absent"


ABSENT = Absent.ABSENT


Value = float | int | str | bool | None
Found = Value | Absent


@dataclass(frozen=True, slots=True)
class Leaf:
    """A single value; its `field` decides which rule of tolerances.yaml applies to it."""

    field: str
    value: Value


Leaves = dict[str, Leaf]
"""Values by place, in the order of the artifact."""

Parts = dict[tuple[str, str], Leaves]
"""The parts of an artifact by topic and field. A log has one for each field; any other file has the part ("", "")."""

COORDINATES, OUTLINE, STRUCTURE = "coordinates", "outline", "structure"
TEXT, NUMBERS = "text", "numbers"
"""Fields of values in figures, which rules refer to. Notebooks have values of these fields and of the two below."""
SOURCE, THEOREM = "source", "theorem"


def parts_of(path: Path) -> Parts:
    """Return the values of an artifact by part and place. Raises UnreadableError."""
    try:
        match path.suffix:
            case ".mcap":
                return _recording(read_log(path))
            case ".csv":
                leaves = _table(path)
            case ".json":
                leaves = _told(from_json(path.read_bytes()))
            case ".svg":
                leaves = dict(_drawing(path.read_bytes()))
            case ".ipynb":
                leaves = _notebook(path.read_bytes())
            case _:
                leaves = {"SHA-256": Leaf("bytes", sha256(path.read_bytes()).hexdigest())}
    except (InputError, ValueError, ElementTree.ParseError) as error:  # UnreadableError says it without the file's name
        raise UnreadableError(str(error).removeprefix(f"{path}: ")) from error
    return {("", ""): leaves}


def same(base: Found, new: Found) -> bool:
    """Whether two values are equal. NaN equals NaN; True and False equal no number."""
    if isinstance(base, bool) or isinstance(new, bool):
        return base is new
    if isinstance(base, float) and isinstance(new, float) and math.isnan(base):
        return math.isnan(new)
    return base == new


_NUMBER = re.compile(r"(?<![\w.])[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?(?![\w.])")


def prose_leaves(place: str, text: str, words: str, numbers: str) -> Iterator[tuple[str, Leaf]]:
    """Yield a text without its numbers as a value of the field `words`, and each number as one of `numbers`."""
    plain = text.replace("−", "-")  # figures write a minus sign in place of a hyphen
    yield place, Leaf(words, _NUMBER.sub("#", plain))
    for i, number in enumerate(_NUMBER.findall(plain), start=1):
        yield f"{place}, number {i}", Leaf(numbers, float(number))


def json_leaves(content: object) -> Leaves:
    """Return every value of parsed JSON by its path, such as `sound.tail.start` or `weights[3]`."""
    return {path: Leaf(path, value) for path, value in _walk(content, "")}


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


def _told(content: object) -> Leaves:
    """Return the values of `json_leaves`, with each sentence split into its words and its numbers.

    The words of a sentence at `proof` are at this place, and its numbers at `proof, number 1`, …
    """
    leaves: Leaves = {}
    for path, leaf in json_leaves(content).items():
        sentence = isinstance(leaf.value, str) and " " in leaf.value
        leaves.update(prose_leaves(path, str(leaf.value), path, path) if sentence else {path: leaf})
    return leaves


def _table(path: Path) -> Leaves:
    """Read a CSV table of numbers. Raises InputError."""
    columns = read_numbers(path)
    lines = zip(*(column.tolist() for column in columns.values()), strict=True)
    cells = ((name, line, value) for line, row in enumerate(lines, 2) for name, value in zip(columns, row, strict=True))
    return {f"column {name}, line {line}": Leaf(name, value) for name, line, value in cells}


def _recording(log: Log) -> Parts:
    """Return the parts of a log: the columns of every series, attachments, and metadata."""
    parts: Parts = {}
    for series in log.series:
        places = [*_distinct(f"t = {t:.12g} s" for t in series.times.tolist())]
        for field, column in {TIME: series.times, **series.fields}.items():
            values = zip(places, column.tolist(), strict=True)
            parts[series.topic, field] = {place: Leaf(field, value) for place, value in values}
    for name, data in log.attachments.items():
        parts[f"attachment {name}", ""] = _told(from_json(data))
    parts["metadata", ""] = json_leaves({record: dict(content) for record, content in log.metadata.items()})
    return parts


def _distinct(names: Iterable[str]) -> Iterator[str]:
    """Yield names; a name that was yielded before gets a number: "name, number 2"."""
    often: Counter[str] = Counter()
    for name in names:
        often[name] += 1
        yield name if often[name] == 1 else f"{name}, number {often[name]}"


_LENGTHS = {"x", "y", "width", "height", "cx", "cy", "r", "x1", "x2", "y1", "y2", "viewBox", "transform", "points", "d"}
# matplotlib names markers, clip paths, hatches and paths of collections by a hash of their coordinates, which rounding
# changes. Here, they are named by their order instead; the coordinates are compared where these elements are defined.
_HASHED = re.compile(r"(?<![\w-])(?:[mph]|C[0-9a-f]+_[0-9a-f]+_)[0-9a-f]{10}(?![\w-])")


def _drawing(data: bytes) -> Iterator[tuple[str, Leaf]]:
    """Read an SVG file with its comments, in which matplotlib writes the text that it draws as outlines.

    An element is named by its tag and by the last identity before it, such as line2d_1. Raises ParseError, and
    ValueError for bytes that are no UTF-8.
    """
    names: dict[str, str] = {}
    parser = ElementTree.XMLParser(target=ElementTree.TreeBuilder(insert_comments=True))
    text = _HASHED.sub(lambda found: names.setdefault(found[0], f"definition-{len(names) + 1}"), data.decode())
    root = ElementTree.fromstring(text, parser)
    for metadata in root.findall("{*}metadata"):  # of the program that drew the figure
        root.remove(metadata)
    for parent in [*root.iter()]:
        for before, after in pairwise(parent):
            if _tag(before) == "comment":
                del after[:]  # outlines of the letters of the text in the comment
    last, places = "svg", []
    for element in root.iter():
        name = element.get("id", "definition-")
        last = last if name.startswith("definition-") else name
        places.append(f"{last} {_tag(element)}")
    for place, element in zip(_distinct(places), root.iter(), strict=True):
        yield place, Leaf(STRUCTURE, _tag(element))
        for name, value in element.attrib.items():
            key = name.rpartition("}")[2]
            if key == "d" and (outline := _outline(value)):
                yield from ((f"{place}: {what}", Leaf(OUTLINE, number)) for what, number in outline.items())
            elif key in _LENGTHS:
                yield from prose_leaves(f"{place}: {key}", value, STRUCTURE, COORDINATES)
            else:
                yield f"{place}: {key}", Leaf(STRUCTURE, value)
        if content := (element.text or "").strip():
            yield from prose_leaves(f"{place}: text", content, TEXT, NUMBERS)


def _tag(element: ElementTree.Element) -> str:
    tag: object = element.tag  # a text, but a function if the element is a comment
    return tag.rpartition("}")[2] if isinstance(tag, str) else "comment"


_COORDINATE = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")


def _outline(path: str) -> dict[str, float]:
    """Return the centre and the extent of an SVG path, in the figure's units, by name; empty if it draws no line.

    Centre and extent do not depend on where lines begin or break, nor on additional points on a line. Curves count as
    the polygons of their control points. Coordinates are absolute, as matplotlib writes them.
    """
    pieces: list[Array] = [np.empty((0, 2, 2))]
    for part in path.split("M")[1:]:
        points = np.array(_COORDINATE.findall(part), dtype=float).reshape(-1, 2)
        points = np.vstack([points, points[:1]]) if "z" in part.lower() else points
        pieces.append(np.stack([points[:-1], points[1:]], axis=1))
    ends = np.concatenate(pieces)
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    if not (length := float(np.sum(lengths))):
        return {}
    (x, y), corners = lengths @ ends.mean(axis=1) / length, ends.reshape(-1, 2)
    (left, top), (right, bottom) = corners.min(axis=0), corners.max(axis=0)
    found = {"centre x": x, "centre y": y, "left": left, "top": top, "right": right, "bottom": bottom}
    return {name: float(number) for name, number in found.items()}


_BY_COQ = "checked by Coq"  # in texts that a notebook shows only if the certificate has exactly the recorded bits


def _notebook(data: bytes) -> Leaves:
    """Read the cells of a notebook of format 4, each named by its first line. ValueError: it is no notebook.

    Pictures are left out.
    """
    content: Any = from_json(data)
    leaves: Leaves = {}
    try:
        sources = ["".join(cell["source"]) for cell in content["cells"]]
        places = _distinct(f"cell {source.partition(chr(10))[0]!r}" for source in sources)
        for cell, source, place in zip(content["cells"], sources, places, strict=True):
            leaves[f"{place}, source"] = Leaf(SOURCE, source)
            for i, output in enumerate(cell.get("outputs", ()), start=1):
                leaves |= _output(f"{place}, output {i}", output)
    except (KeyError, TypeError, AttributeError) as error:
        raise ValueError(f"no notebook: {error!r}") from error
    return leaves


def _output(place: str, output: Mapping[str, Any]) -> Leaves:
    """Return the text and the data that a cell of a notebook shows, without pictures."""
    shown = json_leaves({kind: output[kind] for kind in ("text", "data") if kind in output})
    by_coq = any(_BY_COQ in str(leaf.value) for leaf in shown.values())
    fields = (THEOREM, THEOREM) if by_coq else (TEXT, NUMBERS)
    return {
        at: leaf
        for path, of in shown.items()
        if "image/" not in path
        for at, leaf in prose_leaves(f"{place}, {path}", str(of.value), *fields)
    }
