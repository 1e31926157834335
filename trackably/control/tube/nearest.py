"""The point of the error set that is nearest to another one, for a quadratic distance."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from trackably.arrays import Array
from trackably.control.tube.error_set import ErrorSet
from trackably.control.tube.faces import Faces
from trackably.control.tube.polygon import Polygon
from trackably.gp.bounded.least_squares import nonnegative_least_squares

_GAP = 1e-9
"""A point is nearest if no other is nearer by more than twice this part of the squared distance."""

_DIRECTIONS, _BEGUN = 1000, 8
_MOST_ROUNDS = 100


@dataclass(frozen=True, eq=False)
class Nearest:
    """argmin ‖root (e − d)‖ over d ∈ Z, for an invertible `root` (n, n): e itself where e ∈ Z.

    Any other point found is a convex combination of vertices of Z, and so it is in Z, up to the rounding of a few sums.
    """

    errors: ErrorSet
    root: Array

    def __call__(self, e: Array) -> Array | None:
        """Return d (n,); None where it is not found up to `_GAP`. LinAlgError: not in float64."""
        if self.errors.halfspaces is not None:
            return self._by_blocks(e)
        if self._faces is not None:
            d = self._faces.nearest(e)
            if d is e or self._is_nearest(e, d):
                return d
        return self._combined(e)

    def normal(self, e: Array, nearest: Array) -> Array:
        """Return rootᵀ root (e − d), shape (n,): no other point of Z is farther in this direction than d."""
        return np.asarray(self.root.T @ (self.root @ (e - nearest)))

    def _by_blocks(self, e: Array) -> Array | None:
        """Return the nearest point of a product of polygons: in turn in the coordinates of each, the others held.

        Where e leaves one of them only, the best point for the others left free is nearest, if it does not leave them.
        """
        left = [i for i, polygon in enumerate(self._polygons) if not polygon.contains(e[polygon.block])]
        if len(left) <= 1 < len(self._polygons) and (found := self._with_others_free(e, left)) is not None:
            return found
        d = e.copy()
        for turn in range(_MOST_ROUNDS):
            for polygon in self._polygons:
                d[polygon.block] = polygon.nearest(e, d)
            if len(self._polygons) == 1:
                return d
            if turn and self._is_nearest(e, d):  # the first turn is hardly ever enough
                return d
        return None

    def _with_others_free(self, e: Array, left: list[int]) -> Array | None:
        """Return the nearest d that keeps the polygon in `left` (at most one); None where it leaves another."""
        d = e.copy()
        for i in left:
            polygon, response = self._relaxed[i]
            d[polygon.block] = polygon.nearest(e, e)
            d += response @ (e[polygon.block] - d[polygon.block])
        kept = (polygon.contains(d[polygon.block]) for i, polygon in enumerate(self._polygons) if i not in left)
        return d if all(kept) else None

    def _is_nearest(self, e: Array, d: Array) -> bool:
        """Whether no error is farther in the direction from d, which is in Z, to e."""
        normal = self.normal(e, d)
        return bool(self.errors.support(normal) - normal @ d <= _GAP * (normal @ (e - d)))

    def _combined(self, e: Array) -> Array | None:
        """Return the nearest point by the method of Wolfe, from those of many vertices that are nearest to e.

        The nearest point of the convex hull of a few vertices is found; then the vertex that is farthest in the
        direction from there to e joins them (Wolfe 1976: Finding the nearest point in a polytope, Mathematical
        Programming 11). No point is nearer than the found one by more than that vertex tells.
        """
        if self.errors.contains(e):
            return e
        points, images, squares = self._vertices
        aim = self.root @ e
        begun = np.argpartition(squares - images @ (2 * aim), _BEGUN)[:_BEGUN]
        points, off = points[begun], images[begun] - aim
        unit = float(np.max(np.abs(off)))
        for _ in range(_MOST_ROUNDS):
            weights = _nearest_to_zero(off / unit)
            used = weights > 0
            points, off, weights = points[used], off[used], weights[used]
            towards = -weights @ off
            farthest = self.errors.farthest(self.root.T @ towards)
            image = self.root @ farthest - aim
            distance = towards @ towards
            if towards @ image + distance <= _GAP * distance:
                return np.asarray(weights @ points)
            points, off = np.vstack([points, farthest]), np.vstack([off, image])
        return None

    @cached_property
    def _faces(self) -> Faces | None:
        return Faces.of(self.errors, self.root)

    @cached_property
    def _polygons(self) -> tuple[Polygon, ...]:
        return tuple(Polygon(self.errors, block, self.root) for block in self.errors.blocks)

    @cached_property
    def _relaxed(self) -> tuple[tuple[Polygon, Array], ...]:
        """Each polygon with the distance that is left where all other coordinates are free, and how these respond.

        ‖root (e − d)‖ is least for (e − d)_others = −(root_others)⁺ root_block (e − d)_block. The response (n, b) is
        what is added to d for each unit of (e − d)_block.
        """
        found = []
        for block in self.errors.blocks:
            others = [i for i in range(self.errors.dimension) if i not in block]
            response, left = np.zeros((self.errors.dimension, len(block))), np.zeros_like(self.root)
            response[others] = np.linalg.pinv(self.root[:, others]) @ self.root[:, block]
            left[:, block] = self.root[:, block] - self.root[:, others] @ response[others]
            found.append((Polygon(self.errors, block, left), response))
        return tuple(found)

    @cached_property
    def _vertices(self) -> tuple[Array, Array, Array]:
        """Vertices of Z in many directions (the same for the same Z), their images, and the squares of these."""
        rng = np.random.default_rng(0)
        directions = rng.standard_normal((_DIRECTIONS, self.errors.dimension)) / self.errors.extents
        points = np.array([self.errors.farthest(direction) for direction in directions])
        images = points @ self.root.T
        return points, images, np.einsum("ij,ij->i", images, images)


def _nearest_to_zero(points: Array) -> Array:
    """Return the weights (p,) of the point of a convex hull that is nearest to zero.

    They are a multiple of the w ≥ 0 that minimise ‖Σ_i w_i points_i‖² + (1 − Σ_i w_i)². Raises LinAlgError where they
    are not found in float64.
    """
    rows = np.vstack([points.T, np.ones(len(points))])
    aim = np.zeros(len(rows))
    aim[-1] = 1.0
    weights = nonnegative_least_squares(rows, aim)
    return np.asarray(weights / np.sum(weights))
