"""Figures as values at places: vector graphics, how far their outlines are apart, and PNG pictures."""

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from xml.etree import ElementTree

import numpy as np
import numpy.typing as npt
from PIL import Image, UnidentifiedImageError

from pipeline.compare.content import Leaf, Leaves, Part, UnreadableError, prose_leaves
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
