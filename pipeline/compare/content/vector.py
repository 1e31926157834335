"""Read SVG figures as values at places: elements by identifier, coordinates as numbers, colours and text as text."""

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from xml.etree import ElementTree

from pipeline.compare.content.outlines import distance, split_path
from pipeline.compare.content.prose import prose_leaves
from pipeline.compare.content.values import Leaf, Leaves, Part, UnreadableError

COORDINATES, OUTLINE, COLOUR, STYLE, TEXT, NUMBERS = "coordinates", "outline", "colour", "style", "text", "numbers"
STRUCTURE, ABOUT = "structure", "metadata"
"""The fields that rules know."""

_COLOURS = {"fill", "stroke", "stop-color", "color", "flood-color"}
_LENGTHS = {"x", "y", "width", "height", "cx", "cy", "r", "x1", "x2", "y1", "y2", "viewBox", "transform", "points"}
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
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
        yield place, Leaf(STRUCTURE, _NUMBER.sub("#", value))
        yield from _numbered(f"{place}, number", [float(number) for number in _NUMBER.findall(value)]).items()
    else:
        yield place, Leaf(STRUCTURE, value)
