"""The projection of an error set on one or two coordinates, and its point that is nearest to another one."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from trackable.arrays import Array
from trackable.control.tube.error_set import ErrorSet


@dataclass(frozen=True, eq=False)
class Polygon:
    """The points of `errors` in the coordinates `block`, one or two, with the distance ‖root (e − d)‖ in all n.

    Such a set is a polygon or an interval.
    """

    errors: ErrorSet
    block: list[int]
    root: Array

    def nearest(self, e: Array, d: Array, likely: int | None = None) -> tuple[Array, int | None]:
        """Return the best d in these coordinates, (1,) or (2,), for an error e (n,), with the others of d (n,) held.

        Beside it comes the edge on which it lies, None inside; the edge that is `likely` is tried first.
        """
        aim = e[self.block] + self._coupling @ (e - d)
        if likely is not None and (part := self._part(likely, aim)) is not None:
            return np.asarray(self._corners[likely] + part * self._edges[likely]), likely
        rows, sides = self._halfspaces
        if (rows @ aim <= sides).all():
            return np.asarray(aim), None
        (x, y), (dx, dy), (along_x, along_y) = self._image
        a, b = self._embedding @ aim
        off_x, off_y = a - x, b - y
        part = off_x * along_x
        part += off_y * along_y
        np.maximum(part, 0.0, out=part)
        np.minimum(part, 1.0, out=part)
        off_x -= part * dx
        off_y -= part * dy
        off_x *= off_x
        off_y *= off_y
        off_x += off_y
        at = int(off_x.argmin())
        return np.asarray(self._corners[at] + part[at] * self._edges[at]), at

    def _part(self, at: int, aim: Array) -> float | None:
        """Return how far along an edge the nearest point lies, if it lies inside of the edge; None elsewhere.

        It does where the point of the edge's line that is nearest lies on the edge, and `aim` outside of the line: then
        all of the polygon is on the other side.
        """
        corners, edges, along = self._image
        x, y = self._embedding @ aim - corners[:, at]
        part = float(x * along[0, at] + y * along[1, at])
        outside = (x * edges[1, at] - y * edges[0, at]) * self._turn
        return part if 0 < part < 1 and outside > 0 else None

    @cached_property
    def _turn(self) -> float:
        """1 where the image has its corners in positive sense, as the polygon; −1 where not, and 0 for intervals."""
        return float(np.sign(np.linalg.det(self._embedding))) if len(self.block) == 2 else 0.0

    @cached_property
    def _embedding(self) -> Array:
        """A matrix (2, b): ‖`_embedding` (d − aim)‖ is the distance from the best point without Z."""
        embedding = np.zeros((2, len(self.block)))
        embedding[: len(self.block)] = np.linalg.qr(self.root[:, self.block], mode="r")
        return embedding

    @cached_property
    def _coupling(self) -> Array:
        """How the best point without Z follows the other coordinates of e − d."""
        others = self.root.copy()
        others[:, self.block] = 0.0
        return np.asarray(np.linalg.pinv(self.root[:, self.block]) @ others)

    @cached_property
    def _halfspaces(self) -> tuple[Array, Array]:
        rows = self.errors.normals(self.block)
        return np.ascontiguousarray(rows[:, self.block]), self.errors.support(rows)

    @cached_property
    def _corners(self) -> Array:
        return self.errors.corners(self.block)

    @cached_property
    def _edges(self) -> Array:
        """From each corner to the next."""
        return np.asarray(np.roll(self._corners, -1, axis=0) - self._corners)

    @cached_property
    def _image(self) -> tuple[Array, Array, Array]:
        """Corners and edges (2, v) such that distances are Euclidean, and edges over their squared lengths (2, v)."""
        corners, edges = self._embedding @ self._corners.T, self._embedding @ self._edges.T
        squares = np.sum(edges**2, axis=0)
        return corners, edges, edges / np.where(squares > 0, squares, 1.0)
