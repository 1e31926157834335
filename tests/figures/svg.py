"""What an SVG file draws, in points of its canvas: matplotlib writes letters as paths, so that no font is needed."""

import re
from collections.abc import Iterator
from typing import Final
from xml.etree import ElementTree

import numpy as np
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
            path.get("id"): _points(path, np.eye(3)) for path in self._root.iter(f"{_SVG}path") if path.get("id")
        }
        _, _, self.width, self.height = map(float, self._root.attrib["viewBox"].split())

    def groups(self, kind: str) -> list[Element]:
        """Return the groups of a kind (text, axes, line2d, patch)."""
        return [group for group in self._root.iter(f"{_SVG}g") if re.fullmatch(rf"{kind}_\d+", group.get("id", ""))]

    def paths(self, group: Element) -> list[Matrix]:
        """Return the vertices of each path below a group, letters included, (n, 2) each."""
        return [points for points in self._paths(group, np.eye(3)) if len(points)]

    def _paths(self, node: Element, outer: Matrix) -> Iterator[Matrix]:
        here = outer @ _matrix(node.get("transform", ""))
        if node.tag == f"{_SVG}use":
            yield _moved(self._letters[node.get(_HREF, "").removeprefix("#")], here)
        elif node.tag == f"{_SVG}path":
            yield _points(node, outer)
        elif node.tag == f"{_SVG}g":
            for child in node:
                yield from self._paths(child, here)


def _points(path: Element, outer: Matrix) -> Matrix:
    points = np.array(_NUMBER.findall(path.get("d", "")), dtype=float).reshape(-1, 2)
    return _moved(points, outer @ _matrix(path.get("transform", "")))


def _moved(points: Matrix, by: Matrix) -> Matrix:
    return points @ by[:2, :2].T + by[:2, 2]


def comment(group: Element) -> str:
    """Return what matplotlib notes of a group: the text that it shows."""
    return " ".join((node.text or "").strip() for node in group.iter() if node.tag is ElementTree.Comment)


def _matrix(transform: str) -> Matrix:
    """Return the matrix (3, 3) of what an attribute `transform` says."""
    product = np.eye(3)
    for kind, written in _CHANGE.findall(transform):
        product = product @ _change(kind, [float(number) for number in _NUMBER.findall(written)])
    return product


def _change(kind: str, numbers: list[float]) -> Matrix:
    match kind, numbers:
        case "translate", [x, y]:
            return np.array([[1.0, 0.0, x], [0.0, 1.0, y], [0.0, 0.0, 1.0]])
        case "scale", [x, *same]:
            return np.diag([x, *(same or [x]), 1.0])
        case "rotate", [degrees]:
            c, s = np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees))
            return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    raise ValueError(f"matplotlib does not write {kind}({numbers})")
