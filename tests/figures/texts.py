"""Texts of a figure, and what hides them: each other, curves, the edge of the canvas."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from tests.figures.svg import Drawing, Element, Matrix, comment


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


def texts(svg: bytes) -> list[Text]:
    """Return all texts of a figure that are not empty."""
    drawing = Drawing(svg)
    return [text for group in drawing.groups("text") for text in _text(drawing, group)]


def collisions(svg: bytes, gap: float) -> list[str]:
    """Name texts that are nearer to each other than `gap` [pt], are crossed by a curve, or leave the canvas."""
    drawing, written = Drawing(svg), texts(svg)
    outside = [
        f"{text.content!r} leaves the canvas"
        for text in written
        if min(text.left, text.top, drawing.width - text.right, drawing.height - text.bottom) < 0
    ]
    touching = [
        f"{one.content!r} touches {other.content!r}" for one, other in combinations(written, 2) if one.gap(other) < gap
    ]
    crossed = [said for axes in drawing.groups("axes") for said in _crossed(drawing, axes)]
    return outside + touching + crossed


def _text(drawing: Drawing, group: Element) -> list[Text]:
    letters = drawing.paths(group)
    if not letters:
        return []
    (left, top), (right, bottom) = np.min(np.vstack(letters), axis=0), np.max(np.vstack(letters), axis=0)
    return [Text(comment(group), float(left), float(top), float(right), float(bottom))]


def _crossed(drawing: Drawing, axes: Element) -> list[str]:
    """Name texts of a panel that a curve crosses where the panel shows it."""
    frame = np.vstack(drawing.paths(drawing.groups("patch", axes)[0]))
    shown = Text("", *np.min(frame, axis=0).tolist(), *np.max(frame, axis=0).tolist())
    curves = [path for line in drawing.groups("line2d", axes) for path in drawing.paths(line) if len(path) > 1]
    inside = [text for group in drawing.groups("text", axes) for text in _text(drawing, group)]
    return [f"a curve crosses {text.content!r}" for text in inside if any(_crosses(c, text, shown) for c in curves)]


def _crosses(curve: Matrix, text: Text, shown: Text) -> bool:
    """Whether a segment of a curve meets the part of a text's box that the panel shows."""
    low = np.array([max(text.left, shown.left), max(text.top, shown.top)])
    high = np.array([min(text.right, shown.right), min(text.bottom, shown.bottom)])
    if np.any(low >= high):
        return False
    start, along = curve[:-1], np.diff(curve, axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):  # a segment along an axis enters nowhere, or at once
        ends = np.sort(np.stack([(low - start) / along, (high - start) / along]), axis=0)
    still = along == 0
    within = (low < start) & (start < high)
    enter = np.where(still, np.where(within, -np.inf, np.inf), ends[0]).max(axis=1)
    leave = np.where(still, np.where(within, np.inf, -np.inf), ends[1]).min(axis=1)
    return bool(np.any(np.maximum(enter, 0) < np.minimum(leave, 1)))
