"""The projection of an error set on one or two coordinates, and its point that is nearest to another one."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from trackably.arrays import Array
from trackably.control.tube.error_set import ErrorSet, Places


@dataclass(frozen=True, eq=False)
class Polygon:
    """The points of `errors` in the coordinates `block`, one or two, with the distance ‖root (e − d)‖ in all n.

    Such a set is a polygon or an interval.
    """

    errors: ErrorSet
    block: Places
    root: Array

    def nearest(self, e: Array, d: Array) -> Array:
        """Return the best d in these coordinates, (1,) or (2,), for an error e (n,), with the others of d (n,) held.

        Outside of a convex polygon, a point is nearest to an edge if it is outside of the edge's line and beside the
        edge, and to a corner if it is behind the end of one edge and before the start of the next one.
        """
        aim = e[self.block] + self._coupling @ (e - d)
        rows, offsets = self._sides
        placed, v = rows @ aim - offsets, len(self._edges)
        before, part, outside = placed[:v], placed[1 : v + 1], placed[v + 1 :]
        is_beside = part >= 0
        found = (part <= 1) & (is_beside & (outside > 0) | ~is_beside & (before >= 1))
        at = int(found.argmax())
        if not found[at]:
            if self.contains(aim):
                return np.asarray(aim)
            at = self._closest(aim, part)  # on a border, up to rounding
        return np.asarray(self._corners[at] + min(max(part[at], 0.0), 1.0) * self._edges[at])

    def contains(self, point: Array) -> bool:
        """Whether a point (1,) or (2,) lies in it."""
        rows, limits = self._halfspaces
        return bool((rows @ point <= limits).all())

    def _closest(self, aim: Array, part: Array) -> int:
        """Return the edge with the least distance of all, `part` (v,) of its way along each."""
        points = self._corners + np.clip(part, 0.0, 1.0)[:, None] * self._edges
        return int(np.argmin(np.linalg.norm((points - aim) @ self._embedding.T, axis=1)))

    @cached_property
    def _sides(self) -> tuple[Array, Array]:
        """Rows and offsets (1 + 2 v,) of where a point is: how far along each edge, in parts of it, the last one first.

        Then how far it is outside of each edge's line, in any unit; zero for intervals.
        """
        corners, edges = self._corners @ self._embedding.T, self._edges @ self._embedding.T
        squares = np.sum(edges**2, axis=1, keepdims=True)
        along = edges / np.where(squares > 0, squares, 1.0)
        outward = self._turn * edges[:, ::-1] * [1.0, -1.0]
        rows, starts = np.vstack([along[-1:], along, outward]), np.vstack([corners[-1:], corners, corners])
        return rows @ self._embedding, np.einsum("ij,ij->i", rows, starts)

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
