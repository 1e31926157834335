"""Texts of a figure, and what hides them: each other, the edge of the canvas."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from typing import Final
from xml.etree import ElementTree

import numpy as np
from matplotlib.transforms import Affine2D
from numpy.typing import NDArray

Element = ElementTree.Element
Points = NDArray[np.float64]

_SVG: Final = "{http://www.w3.org/2000/svg}"
_HREF: Final = "{http://www.w3.org/1999/xlink}href"
_NUMBER: Final = re.compile(r"-?\d+(?:\.\d+)?(?:e-?\d+)?")
_CHANGE: Final = re.compile(r"(\w+)\(([^)]*)\)")
_FEWEST = 9
"""Texts of a figure: axes, ticks and a legend."""


@dataclass(frozen=True)
class Text:
    """What is written, and two corners of the box around all of its letters [pt]; y points down."""

    content: str
    low: Points
    high: Points


def collisions(svg: bytes, gap: float) -> list[str]:
    """Name texts that are nearer to each other than `gap` [pt], or leave the canvas; or that there are hardly any."""
    target = ElementTree.TreeBuilder(insert_comments=True)  # they hold what is written
    root = ElementTree.fromstring(svg, ElementTree.XMLParser(target=target))
    canvas, written = np.array(root.attrib["viewBox"].split()[2:], dtype=float), [*_texts(root)]
    outside = [
        f"{text.content!r} leaves the canvas" for text in written if np.any((text.low < 0) | (text.high > canvas))
    ]
    touching = [
        f"{one.content!r} touches {other.content!r}"
        for one, other in combinations(written, 2)
        if np.max([one.low - other.high, other.low - one.high]) < gap
    ]
    return outside + touching + ([] if len(written) >= _FEWEST else ["there are hardly any texts"])


def _texts(root: Element) -> Iterator[Text]:
    """Yield all texts that are not empty. matplotlib writes letters as paths, so that no font is needed."""
    letters = {f"#{path.get('id')}": path for path in root.iter(f"{_SVG}path")}

    def drawn(node: Element, outer: Affine2D) -> Iterator[Points]:
        here = _own(node) + outer
        if node.tag == f"{_SVG}use":
            yield from drawn(letters[node.get(_HREF, "")], here)
        elif node.tag == f"{_SVG}path":
            yield here.transform(np.array(_NUMBER.findall(node.get("d", "")), dtype=float).reshape(-1, 2))
        elif node.tag == f"{_SVG}g":
            for child in node:
                yield from drawn(child, here)

    for group in root.iter(f"{_SVG}g"):
        if re.fullmatch(r"text_\d+", group.get("id", "")):
            points = np.vstack([np.empty((0, 2)), *drawn(group, Affine2D())])
            content = " ".join((node.text or "").strip() for node in group.iter() if node.tag is ElementTree.Comment)
            if len(points):
                yield Text(content, np.min(points, axis=0), np.max(points, axis=0))


def _own(element: Element) -> Affine2D:
    """Return the map from an element's own points to those around it: the last of its changes is done first."""
    own = Affine2D()
    for kind, written in reversed(_CHANGE.findall(element.get("transform", ""))):
        getattr(own, {"rotate": "rotate_deg"}.get(kind, kind))(*map(float, _NUMBER.findall(written)))
    return own
