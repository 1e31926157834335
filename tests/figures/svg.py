"""What an SVG file draws, in points of its canvas: matplotlib writes letters as paths, so that no font is needed."""

import re
from collections.abc import Iterator
from typing import Final
from xml.etree import ElementTree

import numpy as np
from matplotlib.transforms import Affine2D
from numpy.typing import NDArray

Element = ElementTree.Element
Matrix = NDArray[np.float64]

_SVG: Final = "{http://www.w3.org/2000/svg}"
_HREF: Final = "{http://www.w3.org/1999/xlink}href"
_NUMBER: Final = re.compile(r"-?\d+(?:\.\d+)?(?:e-?\d+)?")
_CHANGE: Final = re.compile(r"(\w+)\(([^)]*)\)")


class Drawing:
    """An SVG file of matplotlib, with its groups by what they hold."""

    def __init__(self, svg: bytes) -> None:
        target = ElementTree.TreeBuilder(insert_comments=True)  # they hold what is written
        self._root = ElementTree.fromstring(svg, ElementTree.XMLParser(target=target))
        self._letters = {
            path.get("id"): _points(path, Affine2D()) for path in self._root.iter(f"{_SVG}path") if path.get("id")
        }
        _, _, self.width, self.height = map(float, self._root.attrib["viewBox"].split())

    def groups(self, kind: str) -> list[Element]:
        """Return the groups of a kind (text, axes, line2d, patch)."""
        return [group for group in self._root.iter(f"{_SVG}g") if re.fullmatch(rf"{kind}_\d+", group.get("id", ""))]

    def paths(self, group: Element) -> list[Matrix]:
        """Return the vertices of each path below a group, letters included, (n, 2) each."""
        return [points for points in self._paths(group, Affine2D()) if len(points)]

    def _paths(self, node: Element, outer: Affine2D) -> Iterator[Matrix]:
        here = _inside(outer, node)
        if node.tag == f"{_SVG}use":
            yield np.asarray(here.transform(self._letters[node.get(_HREF, "").removeprefix("#")]))
        elif node.tag == f"{_SVG}path":
            yield _points(node, outer)
        elif node.tag == f"{_SVG}g":
            for child in node:
                yield from self._paths(child, here)


def _points(path: Element, outer: Affine2D) -> Matrix:
    points = np.array(_NUMBER.findall(path.get("d", "")), dtype=float).reshape(-1, 2)
    return np.asarray(_inside(outer, path).transform(points))


def comment(group: Element) -> str:
    """Return what matplotlib notes of a group: the text that it shows."""
    return " ".join((node.text or "").strip() for node in group.iter() if node.tag is ElementTree.Comment)


def _inside(outer: Affine2D, element: Element) -> Affine2D:
    """Return the map from an element's own points to the canvas: the last of its changes is done first."""
    own = Affine2D()
    for kind, written in reversed(_CHANGE.findall(element.get("transform", ""))):
        getattr(own, {"rotate": "rotate_deg"}.get(kind, kind))(*map(float, _NUMBER.findall(written)))
    return own + outer
