"""Texts of a figure, and what hides them: each other, the edge of the canvas."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from tests.figures.svg import Drawing, Element, comment

_FEWEST = 9
"""Texts of a figure: axes, ticks and a legend."""


@dataclass(frozen=True)
class Text:
    """What is written, and the box around all of its letters [pt]; y points down."""

    content: str
    left: float
    top: float
    right: float
    bottom: float

    def gap(self, other: "Text") -> float:
        """Return how far apart two boxes are, along the axis in which they are farther apart; negative: overlap."""
        beside = max(self.left, other.left) - min(self.right, other.right)
        above = max(self.top, other.top) - min(self.bottom, other.bottom)
        return max(beside, above)


def texts(drawing: Drawing) -> list[Text]:
    """Return all texts of a figure that are not empty."""
    return [text for group in drawing.groups("text") for text in _text(drawing, group)]


def collisions(svg: bytes, gap: float) -> list[str]:
    """Name texts that are nearer to each other than `gap` [pt], or leave the canvas; or that there are hardly any."""
    drawing = Drawing(svg)
    written = texts(drawing)
    outside = [
        f"{text.content!r} leaves the canvas"
        for text in written
        if min(text.left, text.top, drawing.width - text.right, drawing.height - text.bottom) < 0
    ]
    touching = [
        f"{one.content!r} touches {other.content!r}" for one, other in combinations(written, 2) if one.gap(other) < gap
    ]
    return outside + touching + ([] if len(written) >= _FEWEST else ["there are hardly any texts"])


def _text(drawing: Drawing, group: Element) -> list[Text]:
    letters = drawing.paths(group)
    if not letters:
        return []
    (left, top), (right, bottom) = np.min(np.vstack(letters), axis=0), np.max(np.vstack(letters), axis=0)
    return [Text(comment(group), float(left), float(top), float(right), float(bottom))]
