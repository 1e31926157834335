"""Read paths of vector graphics, and measure how far two outlines are apart."""

import re

import numpy as np

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
