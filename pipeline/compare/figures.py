"""Figures and notebooks as values at places: vector graphics and their outlines, PNG pictures, outputs of cells."""

import re
from base64 import b64decode
from binascii import Error as Base64Error
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from difflib import SequenceMatcher
from hashlib import sha256
from io import BytesIO
from typing import Any
from xml.etree import ElementTree

import numpy as np
import numpy.typing as npt
from PIL import Image, UnidentifiedImageError

from pipeline.compare.content import Leaf, Leaves, Part, UnreadableError, json_leaves, prose_leaves, read_json
from trackably.arrays import Array

_TOKEN = re.compile(r"[A-Za-z]|[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_POINTS = {"M": 1, "L": 1, "Q": 2, "C": 3, "z": 0, "Z": 0}
"""Points that follow a letter; all are absolute, as matplotlib writes them."""


def split_path(text: str) -> tuple[str, list[float]]:
    """Return the letters of a path and its numbers; the e of 1e5 belongs to a number."""
    tokens = _TOKEN.findall(text)
    return "".join(t for t in tokens if t.isalpha()), [float(t) for t in tokens if not t.isalpha()]


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
    letters, numbers = split_path(path)
    if not set(letters) <= _POINTS.keys() or 2 * sum(_POINTS[letter] for letter in letters) != len(numbers):
        return None
    points = iter(np.array(numbers).reshape(-1, 2))
    pieces: list[Array] = []
    begin = here = np.zeros(2)
    for letter in letters:
        if letter in "zZ":
            pieces.append(np.stack([here, begin]))
            here = begin
        for _ in range(_POINTS[letter]):
            there = next(points)
            if letter == "M":
                begin = there
            else:
                pieces.append(np.stack([here, there]))
            here = there
    return np.stack(pieces) if pieces else None


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


COORDINATES, OUTLINE, COLOUR, STYLE, TEXT, NUMBERS = "coordinates", "outline", "colour", "style", "text", "numbers"
STRUCTURE, ABOUT = "structure", "metadata"
"""The fields that rules know."""

_COLOURS = {"fill", "stroke", "stop-color", "color", "flood-color"}
_LENGTHS = {"x", "y", "width", "height", "cx", "cy", "r", "x1", "x2", "y1", "y2", "viewBox", "transform", "points"}
_LENGTH_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
# matplotlib names markers, clip paths, hatches and collections' paths by a hash of their look: rounding changes the
# name. They are named by their order instead; their look is compared where they are defined.
_HASHED = re.compile(r"(?<![\w-])(?:[mph]|C[0-9a-f]+_[0-9a-f]+_)[0-9a-f]{10}(?![\w-])")
_MUCH = 0.5  # [units of the figure]: two paths whose points differ by more are looked at as outlines


@dataclass(frozen=True)
class Drawing:
    """Values by place, and paths as they are written."""

    leaves: Leaves
    paths: dict[str, str]


def read_drawing(data: bytes) -> Drawing:
    """Read an SVG file with its comments, in which matplotlib writes the text that it draws as outlines.

    Raises UnreadableError.
    """
    try:
        text = _renamed(data.decode())
        parser = ElementTree.XMLParser(target=ElementTree.TreeBuilder(insert_comments=True))
        root = ElementTree.fromstring(text, parser)
    except (ElementTree.ParseError, UnicodeDecodeError) as error:
        raise UnreadableError(f"no SVG: {error}") from error
    paths: dict[str, str] = {}
    return Drawing(dict(_element(root, "svg", paths)), paths)


def drawing_parts(base: Drawing, new: Drawing) -> list[Part]:
    """Return one part, whose places are elements and their properties."""
    leaves: tuple[dict[str, Leaf], dict[str, Leaf]] = ({**base.leaves}, {**new.leaves})
    for place, path in base.paths.items():
        other = new.paths.get(place, path)
        for side, found in zip(leaves, _path_leaves(path, other), strict=True):
            side.update({f"{place}{at}": leaf for at, leaf in found.items()})
    for place in new.paths.keys() - base.paths.keys():
        leaves[1][place] = Leaf(STRUCTURE, "a path")
    for place in base.paths.keys() - new.paths.keys():
        leaves[0][place] = Leaf(STRUCTURE, "a path")
    return [Part("", "", *leaves)]


def _path_leaves(base: str, new: str) -> tuple[dict[str, Leaf], dict[str, Leaf]]:
    """Return coordinates, or the distance between the outlines where letters differ or coordinates are far apart."""
    (letters, numbers), (other_letters, other_numbers) = split_path(base), split_path(new)
    alike = letters == other_letters and len(numbers) == len(other_numbers)
    far = not alike or any(abs(a - b) > _MUCH for a, b in zip(numbers, other_numbers, strict=True))
    apart = distance(base, new) if far else None
    if apart is not None and (not alike or apart < _MUCH):
        place = ": distance between the outlines"
        return {place: Leaf(OUTLINE, 0.0)}, {place: Leaf(OUTLINE, apart)}
    sides = ((letters, numbers), (other_letters, other_numbers))
    first, second = (
        {": commands": Leaf(STRUCTURE, own_letters), **_numbered(": coordinate", own)} for own_letters, own in sides
    )
    return first, second


def _numbered(name: str, numbers: list[float]) -> dict[str, Leaf]:
    return {f"{name} {i}": Leaf(COORDINATES, number) for i, number in enumerate(numbers, start=1)}


def _renamed(text: str) -> str:
    names: dict[str, str] = {}
    return _HASHED.sub(lambda found: names.setdefault(found[0], f"definition-{len(names) + 1}"), text)


def _element(element: ElementTree.Element, place: str, paths: dict[str, str]) -> Iterator[tuple[str, Leaf]]:
    about = "metadata[1]" in place.split("/")
    if not element.attrib and not len(element):
        yield f"{place}: element", Leaf(ABOUT if about else STRUCTURE, _tag(element))
    for name, value in element.attrib.items():
        key = name.rpartition("}")[2]
        if key == "d":
            paths[place] = value
        else:
            yield from _attribute(f"{place}: {key}", key, value, about)
    if content := (element.text or "").strip():
        words, numbers = (ABOUT, ABOUT) if about else (TEXT, NUMBERS)
        yield from prose_leaves(f"{place}: text", content, words, numbers)
    seen: Counter[str] = Counter()
    before = ""
    for child in element:
        tag = _tag(child)
        seen[tag] += 1
        # The letters of a text: the comment before them says what they are, and where they stand is theirs.
        shown = ElementTree.Element(child.tag, child.attrib) if before == "comment" and tag == "g" else child
        yield from _element(shown, f"{place}/{_name(child, tag, seen[tag])}".removeprefix("svg/"), paths)
        before = tag


def _name(element: ElementTree.Element, tag: str, number: int) -> str:
    identifier = element.get("id")
    return identifier if identifier and not identifier.startswith("definition-") else f"{tag}[{number}]"


def _tag(element: ElementTree.Element) -> str:
    tag: object = element.tag  # of a comment it is a function
    return tag.rpartition("}")[2] if isinstance(tag, str) else "comment"


def _attribute(place: str, key: str, value: str, about: bool) -> Iterator[tuple[str, Leaf]]:
    if about:
        yield place, Leaf(ABOUT, value)
    elif key == "style":
        for declaration in value.split(";"):
            name, _, setting = (part.strip() for part in declaration.partition(":"))
            if name:
                yield f"{place} {name}", Leaf(COLOUR if name in _COLOURS else STYLE, setting)
    elif key in _COLOURS:
        yield place, Leaf(COLOUR, value)
    elif key in _LENGTHS:
        yield place, Leaf(STRUCTURE, _LENGTH_NUMBER.sub("#", value))
        yield from _numbered(f"{place}, number", [float(number) for number in _LENGTH_NUMBER.findall(value)]).items()
    else:
        yield place, Leaf(STRUCTURE, value)


SIZE, PIXELS = "size", "pixels"
"""The fields that rules know; pixels have four channels of 0 … 255."""

_CHANNELS = ("red", "green", "blue", "opacity")

Picture = npt.NDArray[np.uint8]


def read_picture(data: bytes) -> Picture:
    """Read a picture, shape (rows, columns, 4 channels). Raises UnreadableError."""
    try:
        with Image.open(BytesIO(data)) as image:
            return np.asarray(image.convert("RGBA"))
    except (UnidentifiedImageError, OSError, SyntaxError, ValueError) as error:
        raise UnreadableError(f"no picture: {error}") from error


def picture_parts(base: Picture, new: Picture) -> list[Part]:
    """Return one part, whose places are pixels."""
    return [Part("", "", *picture_leaves(base, new))]


def picture_leaves(base: Picture, new: Picture, place: str = "") -> tuple[Leaves, Leaves]:
    """Return the sizes of both, and for each channel the pixel that differs most where sizes agree.

    Places begin with `place`.
    """
    sides: tuple[dict[str, Leaf], dict[str, Leaf]] = ({}, {})
    for side, picture in zip(sides, (base, new), strict=True):
        side[f"{place}size"] = Leaf(SIZE, f"{picture.shape[1]} × {picture.shape[0]}")
    if base.shape == new.shape:
        apart = np.abs(base.astype(int) - new.astype(int))
        for i, channel in enumerate(_CHANNELS):
            row, column = divmod(int(np.argmax(apart[:, :, i])), base.shape[1])
            for side, picture in zip(sides, (base, new), strict=True):
                at = f"{place}{channel} of the pixel at column {column}, row {row}"
                side[at] = Leaf(PIXELS, int(picture[row, column, i]))
    return sides


SOURCE, IMAGE, THEOREM = "source", "image", "theorem"
"""The fields that rules know, beside those of pictures."""

_PNG = "image/png"
_BY_COQ = "checked by Coq"  # in texts that are shown of these very bits of a certificate alone


@dataclass(frozen=True)
class Cell:
    """A source, and for each output its media type and content: pictures as bytes, everything else as text or JSON."""

    source: str
    outputs: tuple[tuple[str, Any], ...]


def read_notebook(data: bytes) -> list[Cell]:
    """Read the cells of a notebook of format 4, without counters and identifiers. Raises UnreadableError."""
    content = read_json(data)
    try:
        cells: list[dict[str, Any]] = content["cells"]  # type: ignore[index]
        return [
            Cell(_joined(cell["source"]), tuple(o for out in cell.get("outputs", ()) for o in _outputs(out)))
            for cell in cells
        ]
    except (KeyError, TypeError, AttributeError, Base64Error) as error:
        raise UnreadableError(f"no notebook: {error!r}") from error


def notebook_parts(base: list[Cell], new: list[Cell]) -> list[Part]:
    """Return one part, whose places are cells, outputs and lines; cells are paired by their sources."""
    sides: tuple[dict[str, Leaf], dict[str, Leaf]] = ({}, {})
    for i, j in _paired([cell.source for cell in base], [cell.source for cell in new]):
        cells = None if i is None else base[i], None if j is None else new[j]
        place = f"cell {i}" if i is not None else f"cell {j} of NEW"
        for side, leaves in zip(sides, _cell_leaves(*cells, place), strict=True):
            side.update(leaves)
    return [Part("", "", *sides)]


def _joined(written: str | list[str]) -> str:
    return written if isinstance(written, str) else "".join(written)


def _outputs(output: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    match output["output_type"]:
        case "stream":
            yield output["name"], _joined(output["text"])
        case "error":
            yield "error", f"{output['ename']}: {output['evalue']}"
        case _:
            for media, data in output["data"].items():
                binary = media.startswith("image/") and media != "image/svg+xml"
                textual = isinstance(data, str) or (isinstance(data, list) and not media.endswith("json"))
                yield media, b64decode(_joined(data)) if binary else _joined(data) if textual else data


def _paired(base: list[str], new: list[str]) -> Iterator[tuple[int | None, int | None]]:
    """Pair cells with equal sources, and those between them in their order."""
    for _, i, i_end, j, j_end in SequenceMatcher(None, base, new, autojunk=False).get_opcodes():
        for k in range(max(i_end - i, j_end - j)):
            yield i + k if i + k < i_end else None, j + k if j + k < j_end else None


def _cell_leaves(base: Cell | None, new: Cell | None, place: str) -> tuple[dict[str, Leaf], dict[str, Leaf]]:
    sides: tuple[dict[str, Leaf], dict[str, Leaf]] = ({}, {})
    contents = [_named(cell) if cell else {} for cell in (base, new)]
    for side, cell in zip(sides, (base, new), strict=True):
        if cell:
            side[f"{place}, source"] = Leaf(SOURCE, cell.source)
    for name in {**contents[0], **contents[1]}:
        both = [content.get(name) for content in contents]
        for side, leaves in zip(sides, _content_leaves(f"{place}, {name}", *both), strict=True):
            side.update(leaves)
    return sides


def _named(cell: Cell) -> dict[str, Any]:
    return {f"output {i}, {media}": content for i, (media, content) in enumerate(cell.outputs, start=1)}


def _content_leaves(place: str, base: Any, new: Any) -> tuple[Leaves, Leaves]:
    if place.endswith(_PNG) and isinstance(base, bytes) and isinstance(new, bytes) and base != new:
        return picture_leaves(read_picture(base), read_picture(new), f"{place}, ")
    return _output_leaves(place, base), _output_leaves(place, new)


def _output_leaves(place: str, content: Any) -> dict[str, Leaf]:
    match content:
        case None:
            return {}
        case bytes():
            return {place: Leaf(IMAGE, f"SHA-256 {sha256(content).hexdigest()[:16]}")}
        case str():
            return dict(_text_leaves(place, content))
    return {f"{place}, {path}": Leaf(TEXT, leaf.value) for path, leaf in json_leaves(content).items()}


def _text_leaves(place: str, text: str) -> Iterator[tuple[str, Leaf]]:
    """Yield the words and the numbers of each line."""
    fields = (THEOREM, THEOREM) if _BY_COQ in text else (TEXT, NUMBERS)
    for i, line in enumerate(text.splitlines(), start=1):
        yield from prose_leaves(f"{place}, line {i}", line, *fields)
