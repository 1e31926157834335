"""Artifacts as values at places: JSON, CSV, logs, vector graphics, pictures and notebooks in one form.

Text is taken apart: words have to stay, and numbers may move within tolerance."""

import csv
import json
import math
import re
from base64 import b64decode
from binascii import Error as Base64Error
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from enum import Enum
from functools import lru_cache
from hashlib import sha256
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import numpy.typing as npt
from PIL import Image, UnidentifiedImageError

from pipeline.storage.logs import TIME, Log, LogError, read_log
from trackably.arrays import Array


class UnreadableError(Exception):
    """An artifact is not of the format that its name promises; the message says why, without naming the file."""


class Absent(Enum):
    """Stands for the value at a place that one side does not have."""

    ABSENT = "absent"


ABSENT = Absent.ABSENT


class Outline(str):
    """A path of a vector graphic, as it is written there."""

    __slots__ = ()


Picture = npt.NDArray[np.uint8]
"""Shape (rows, columns, 4 channels)."""

Value = float | int | str | bool | None
Found = Value | Absent


@dataclass(frozen=True, slots=True)
class Leaf:
    """A single value; rules know it by its `field`."""

    field: str
    value: Value | Picture


Leaves = dict[str, Leaf]
"""Values by place, in the order of the artifact."""

Parts = dict[tuple[str, str], Leaves]
"""The parts of an artifact by topic and field. Only logs have more than the part ("", "")."""

COORDINATES, OUTLINE, STRUCTURE, TEXT, NUMBERS, ABOUT = (
    *("coordinates", "outline", "structure"),
    *("text", "numbers", "metadata"),
)
"""The fields of figures that rules know; those of notebooks are these, and the following."""
SOURCE, THEOREM, PIXELS = "source", "theorem", "pixels"


def parts_of(path: Path) -> Parts:
    """Return the values of an artifact. Raises UnreadableError."""
    if path.suffix == ".mcap":
        return _recording(read_recording(path))
    return {("", ""): _READERS.get(path.suffix, _unknown)(path.read_bytes())}


def differences(place: str, base: Leaf | None, new: Leaf | None) -> Iterator[tuple[str, str, Found, Found]]:
    """Yield place, field and both values wherever two values differ; a side may have none."""
    field, values = (base or new or Leaf("", None)).field, [leaf.value if leaf else ABSENT for leaf in (base, new)]
    match values:
        case [np.ndarray() as one, np.ndarray() as other] if one.shape == other.shape:
            at = np.unravel_index(np.argmax(np.abs(one.astype(int) - other.astype(int))), one.shape)
            row, column, channel = (int(i) for i in at)
            if one[at] != other[at]:
                named = ("red", "green", "blue", "opacity")[channel]
                where = f"{place}{named} of the pixel at column {column}, row {row}"
                yield where, field, int(one[at]), int(other[at])
        case [Outline() as one, Outline() as other] if one != other:
            yield from _outline_differences(place, one, other)
        case _:
            first, second = (" × ".join(map(str, v.shape)) if isinstance(v, np.ndarray) else v for v in values)
            if not _same(first, second):
                yield place, field, first, second


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
    """Return the same, with sentences taken apart: the words are at `proof`, its numbers at `proof, number 1` …"""
    leaves: Leaves = {}
    for path, leaf in json_leaves(content).items():
        sentence = isinstance(leaf.value, str) and " " in leaf.value
        leaves.update(prose_leaves(path, str(leaf.value), path, path) if sentence else {path: leaf})
    return leaves


def _table(data: bytes) -> Leaves:
    """Read a CSV table. Raises UnreadableError where the header repeats a name, or a row has another length."""
    try:
        header, *rows = csv.reader(StringIO(data.decode(), newline=""), strict=True)
    except (ValueError, csv.Error) as error:
        raise UnreadableError(f"no CSV table: {error}") from error
    if len({*header}) != len(header):
        raise UnreadableError("no CSV table: the first line has to name the columns, each once")
    leaves = {}
    for number, row in enumerate(rows, start=2):
        if len(row) != len(header):
            raise UnreadableError(f"line {number} has {len(row)} cells below a header of {len(header)}")
        for column, cell in zip(header, row, strict=True):
            leaves[f"column {column}, line {number}"] = Leaf(column, _cell(cell))
    return leaves


def _cell(text: str) -> Value:
    """Return a number where the cell holds one, None where it is empty."""
    try:
        return float(text) if text else None
    except ValueError:
        return text


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


def _recording(log: Log) -> Parts:
    """Return the columns of every series, other topics, attachments, and the metadata with the units."""
    parts: Parts = {}
    for series in log.series:
        places = [*_distinct(f"t = {t:.12g} s" for t in series.times.tolist())]
        for field, column in {TIME: series.times, **series.fields}.items():
            values = zip(places, column.tolist(), strict=True)
            parts[series.topic, field] = {place: Leaf(field, value) for place, value in values}
    for of in log.documents:
        parts[of.topic, ""] = _told({"messages": [{"time": time, **message} for time, message in of.messages]})
    for name, data in log.attachments.items():
        parts[f"attachment {name}", ""] = _told(read_json(data))
    units = {series.topic: dict(series.units) for series in log.series if series.units}
    metadata = {record: dict(content) for record, content in log.metadata.items()}
    parts["metadata", ""] = json_leaves({**metadata, "unit": units})
    return parts


def _distinct(names: Iterator[str]) -> Iterator[str]:
    """Yield names, those that were there before with their number."""
    often: Counter[str] = Counter()
    for name in names:
        often[name] += 1
        yield name if often[name] == 1 else f"{name}, number {often[name]}"


_LENGTHS = {"x", "y", "width", "height", "cx", "cy", "r", "x1", "x2", "y1", "y2", "viewBox", "transform", "points"}
# matplotlib names markers, clip paths, hatches and collections' paths by a hash of their look: rounding changes the
# name. They are named by their order instead; their look is compared where they are defined.
_HASHED = re.compile(r"(?<![\w-])(?:[mph]|C[0-9a-f]+_[0-9a-f]+_)[0-9a-f]{10}(?![\w-])")


def _drawing(data: bytes) -> Leaves:
    """Read an SVG file with its comments, in which matplotlib writes the text that it draws as outlines.

    Raises UnreadableError.
    """
    names: dict[str, str] = {}
    parser = ElementTree.XMLParser(target=ElementTree.TreeBuilder(insert_comments=True))
    try:
        text = _HASHED.sub(lambda found: names.setdefault(found[0], f"definition-{len(names) + 1}"), data.decode())
        return dict(_element(ElementTree.fromstring(text, parser), "svg"))
    except (ElementTree.ParseError, UnicodeDecodeError) as error:
        raise UnreadableError(f"no SVG: {error}") from error


def _element(element: ElementTree.Element, place: str) -> Iterator[tuple[str, Leaf]]:
    about = "metadata[1]" in place.split("/")
    yield f"{place}: element", Leaf(ABOUT if about else STRUCTURE, _tag(element))
    for name, value in element.attrib.items():
        key = name.rpartition("}")[2]
        at = f"{place}: {key}"
        if key in _LENGTHS and not about:
            yield from prose_leaves(at, value, STRUCTURE, COORDINATES)
        else:
            yield at, Leaf(ABOUT if about else STRUCTURE, Outline(value) if key == "d" else value)
    if content := (element.text or "").strip():
        yield from prose_leaves(f"{place}: text", content, *((ABOUT, ABOUT) if about else (TEXT, NUMBERS)))
    seen: Counter[str] = Counter()
    before = ""
    for child in element:
        tag = _tag(child)
        seen[tag] += 1
        name = child.get("id", "definition-")
        named = f"{tag}[{seen[tag]}]" if name.startswith("definition-") else name
        # The letters of a text: the comment before them says what they are, and where they stand is theirs.
        shown = ElementTree.Element(child.tag, child.attrib) if before == "comment" and tag == "g" else child
        yield from _element(shown, f"{place}/{named}".removeprefix("svg/"))
        before = tag


def _tag(element: ElementTree.Element) -> str:
    tag: object = element.tag  # of a comment it is a function
    return tag.rpartition("}")[2] if isinstance(tag, str) else "comment"


_MUCH = 0.5  # [units of the figure]: two paths whose points differ by more are looked at as outlines
_TOKEN = re.compile(r"[A-Za-z]|[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_POINTS = {"M": 1, "L": 1, "Q": 2, "C": 3, "z": 0, "Z": 0}
"""Points that follow a letter; all are absolute, as matplotlib writes them."""


def _outline_differences(place: str, base: str, new: str) -> Iterator[tuple[str, str, Found, Found]]:
    """Yield coordinates, or the distance between the outlines where letters differ or coordinates are far apart."""
    (letters, numbers), (other_letters, other_numbers) = _split_path(base), _split_path(new)
    alike = letters == other_letters and numbers.size == other_numbers.size
    moved = np.abs(numbers - other_numbers) if alike else np.array([math.inf])
    apart = distance(base, new) if np.max(moved, initial=0.0) > _MUCH else None
    if apart is not None and (not alike or apart < _MUCH):
        yield f"{place}: distance between the outlines", OUTLINE, 0.0, apart
    elif alike:
        for i in np.flatnonzero(moved).tolist():
            yield f"{place}: coordinate {i + 1}", COORDINATES, float(numbers[i]), float(other_numbers[i])
    else:
        yield place, STRUCTURE, base, new


def _split_path(text: str) -> tuple[str, Array]:
    """Return the letters of a path and its numbers; the e of 1e5 belongs to a number."""
    tokens = _TOKEN.findall(text)
    numbers = [float(token) for token in tokens if not token.isalpha()]
    return "".join(token for token in tokens if token.isalpha()), np.array(numbers)


def distance(base: str, new: str) -> float | None:
    """Return the largest distance from a vertex of one path to the other path, in the paths' units.

    It does not depend on where paths begin or break. Curves count as the polygons of their control points. None where
    a path has no line, or letters other than those above.
    """
    first, second = _segments(base), _segments(new)
    if first is None or second is None:
        return None
    return max(_one_way(first, second), _one_way(second, first))


def _segments(path: str) -> Array | None:
    """Return the straight pieces of a path, shape (n, 2 ends, 2)."""
    letters, numbers = _split_path(path)
    if not set(letters) <= _POINTS.keys() or 2 * sum(_POINTS[letter] for letter in letters) != numbers.size:
        return None
    pieces: list[Array] = []
    for part in path.split("M")[1:]:
        points = _split_path(part)[1].reshape(-1, 2)
        if part.rstrip()[-1] in "zZ":
            points = np.vstack([points, points[:1]])
        pieces.append(np.stack([points[:-1], points[1:]], axis=1))
    return np.concatenate(pieces) if any(map(len, pieces)) else None


def _one_way(of: Array, to: Array) -> float:
    """Return the largest distance from an end of a piece of `of` to the nearest piece of `to`."""
    start, along = to[:, 0], to[:, 1] - to[:, 0]
    length = np.maximum(np.sum(along**2, axis=1), np.finfo(float).tiny)
    worst = 0.0
    for point in np.unique(of.reshape(-1, 2), axis=0):
        share = np.clip(np.sum((point - start) * along, axis=1) / length, 0.0, 1.0)
        nearest = start + share[:, None] * along
        worst = max(worst, float(np.min(np.sum((point - nearest) ** 2, axis=1))))
    return float(np.sqrt(worst))


def _picture(data: bytes) -> Picture:
    try:
        with Image.open(BytesIO(data)) as image:
            return np.asarray(image.convert("RGBA"))
    except (UnidentifiedImageError, OSError, SyntaxError, ValueError) as error:
        raise UnreadableError(f"no picture: {error}") from error


_BY_COQ = "checked by Coq"  # in texts that are shown of these very bits of a certificate alone


def _notebook(data: bytes) -> Leaves:
    """Read the cells of a notebook of format 4, each named by its first line. Raises UnreadableError."""
    content: Any = read_json(data)
    leaves: Leaves = {}
    try:
        sources = ["".join(cell["source"]) for cell in content["cells"]]
        places = _distinct(f"cell {source.partition(chr(10))[0]!r}" for source in sources)
        for cell, source, place in zip(content["cells"], sources, places, strict=True):
            leaves[f"{place}, source"] = Leaf(SOURCE, source)
            for i, output in enumerate(cell.get("outputs", ()), start=1):
                for media, shown in _shown(output).items():
                    leaves.update(_output(f"{place}, output {i}, {media}", media, shown))
    except (KeyError, TypeError, AttributeError, Base64Error) as error:
        raise UnreadableError(f"no notebook: {error!r}") from error
    return leaves


def _shown(output: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return what an output shows by media type."""
    match output["output_type"]:
        case "stream":
            return {output["name"]: output["text"]}
        case "error":
            return {"error": f"{output['ename']}: {output['evalue']}"}
    shown: Mapping[str, Any] = output["data"]
    return shown


def _output(place: str, media: str, content: Any) -> Leaves:
    if media.endswith("json"):
        return {f"{place}, {path}": Leaf(TEXT, leaf.value) for path, leaf in json_leaves(content).items()}
    text = "".join(content)
    if media == "image/png":
        return {f"{place}, ": Leaf(PIXELS, _picture(b64decode(text)))}
    fields = (THEOREM, THEOREM) if _BY_COQ in text else (TEXT, NUMBERS)
    return {
        at: leaf
        for i, line in enumerate(text.splitlines(), start=1)
        for at, leaf in prose_leaves(f"{place}, line {i}", line, *fields)
    }


def _unknown(data: bytes) -> Leaves:
    return {"SHA-256": Leaf("bytes", sha256(data).hexdigest())}


_READERS: Mapping[str, Callable[[bytes], Leaves]] = {
    ".json": lambda data: _told(read_json(data)),
    ".csv": _table,
    ".svg": _drawing,
    ".png": lambda data: {"": Leaf(PIXELS, _picture(data))},
    ".ipynb": _notebook,
}
