"""The invariant set of the error in float64, and its point nearest to another point."""

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from math import comb

import numpy as np

from trackably.arrays import Array
from trackably.gp.bounded import nonnegative_least_squares
from trackably.systems.disturbances import Zonotope
from trackably.systems.tightening import InvariantSet

_ROUNDING, _OF_LEAST_SQUARES = 1e-12, 1e-9
"""Tolerances of membership, relative to the size of the set along each axis: with facets, and without them."""

_MOST_FACETS = 100_000

_GAP = 1e-9
"""A point counts as nearest if no other is nearer by more than twice this part of the squared distance."""

_LEAST_GAP = 1e-13
"""Gap that rounding leaves if a point is hardly outside, relative to the squared size of the searched points."""

_DIRECTIONS, _BEGUN = 1000, 8
_MOST_ROUNDS = 100


@dataclass(frozen=True, eq=False)
class ErrorSet:
    """Z of an invariant set: its parts ⊕_{i<N} A_Kⁱ W ⊕ A_Kᴺ (1 − α)⁻¹ ⊕_{i<s} A_Kⁱ P, summed in float64.

    It is `centre` ⊕ {Σ_j ξ_j g_j : |ξ_j| ≤ 1} ⊕ the convex hulls `hulls`. If W is a zonotope, there are no hulls and Z
    is a zonotope. If W is a convex hull, each A_Kⁱ W is a hull, and the generators g_j are those of P.
    """

    invariant: InvariantSet

    @property
    def dimension(self) -> int:
        return len(self.invariant.box)

    def contains(self, e: Array) -> bool:
        """Whether an error (n,) is in Z, up to rounding. LinAlgError: it cannot be decided in float64."""
        if self.facets is None:
            return Nearest(self, np.diag(1 / self.extents))(e) is e
        rows, limits = self.facets
        return bool((rows @ e <= limits).all())

    def support(self, rows: Array) -> Array:
        """Return h_Z(row) for rows (…, n): shape (…)."""
        found = rows @ self.centre + np.abs(rows @ self.generators.T).sum(axis=-1)
        for hull in self.hulls:
            found = found + np.max(rows @ hull.T, axis=-1)
        return np.asarray(found)

    def farthest(self, row: Array) -> Array:
        """Return a vertex (n,) of Z at which row · e is largest, up to rounding."""
        found = self.centre + np.where(self.generators @ row >= 0, 1.0, -1.0) @ self.generators
        if len(self.hulls):
            found = found + self.hulls[np.arange(len(self.hulls)), np.argmax(self.hulls @ row, axis=1)].sum(axis=0)
        return np.asarray(found)

    @cached_property
    def extents(self) -> Array:
        """The width of Z along each axis (n,); 1 if it is zero."""
        axes = np.eye(self.dimension)
        reach = self.support(axes) + self.support(-axes)
        return np.where(reach > 0, reach, 1.0)

    @cached_property
    def vertices(self) -> Array:
        """Distinct vertices (v, n) of Z, those in many random directions, with a fixed seed."""
        directions = np.random.default_rng(0).standard_normal((_DIRECTIONS, self.dimension)) / self.extents
        points = np.array([self.farthest(direction) for direction in directions])
        _, chosen = np.unique(np.round(points / self.extents, 9), axis=0, return_index=True)
        return points[chosen]

    @cached_property
    def centre(self) -> Array:
        """The centre (n,) of the generators."""
        Z = self.invariant
        if not isinstance(Z.disturbance, Zonotope):
            return np.zeros(self.dimension)
        at, total = Z.disturbance.matrix[0], np.zeros(self.dimension)
        for _ in range(Z.head):
            total, at = total + at, Z.closed_loop @ at
        return total

    @cached_property
    def generators(self) -> Array:
        """The generators (g, n), none of them zero."""
        Z, W = self.invariant, self.invariant.disturbance
        of_head = W.generator_matrix if isinstance(W, Zonotope) else np.zeros((0, self.dimension))
        found, head, tail = [], of_head, np.diag(Z.box) / (1 - Z.contraction)
        for i in range(Z.head + Z.terms):
            found.append(head if i < Z.head else tail)
            head, tail = head @ Z.closed_loop.T, tail @ Z.closed_loop.T
        stacked = np.vstack(found)
        return np.asarray(stacked[np.any(stacked != 0, axis=1)])

    @cached_property
    def hulls(self) -> Array:
        """The vertices (N, v, n) of A_Kⁱ W for i < N; empty if W is a zonotope."""
        Z, W = self.invariant, self.invariant.disturbance
        if isinstance(W, Zonotope):
            return np.zeros((0, 1, self.dimension))
        found = [W.matrix]
        while len(found) < Z.head:
            found.append(found[-1] @ Z.closed_loop.T)
        return np.array(found)

    @cached_property
    def facets(self) -> tuple[Array, Array] | None:
        """H (f, n) and h (f,) with Z = {e : H e ≤ h}, up to rounding; None for hulls, flat sets, and too many facets.

        A facet of a zonotope is spanned by n − 1 of its generators.
        """
        G, n = self.generators / self.extents, self.dimension
        if len(self.hulls) or comb(len(G), n - 1) > _MOST_FACETS or np.linalg.matrix_rank(G) < n:
            return None
        unit = G / np.linalg.norm(G, axis=1, keepdims=True)
        spanning = unit[np.array(list(combinations(range(len(G)), n - 1)), dtype=int)]
        normals = np.stack([(-1) ** i * np.linalg.det(np.delete(spanning, i, axis=2)) for i in range(n)], axis=1)
        sizes = np.linalg.norm(normals, axis=1)
        rows = normals[sizes > _ROUNDING] / sizes[sizes > _ROUNDING, None]
        _, chosen = np.unique(np.round(rows, 12), axis=0, return_index=True)  # of a product, many are the same
        rows = np.vstack([rows[chosen], -rows[chosen]]) / self.extents
        return rows, self.support(rows) + _ROUNDING * np.abs(rows) @ self.extents


@dataclass(frozen=True, eq=False)
class Nearest:
    """argmin ‖root (e − d)‖ over d ∈ Z, for an invertible `root` (n, n); e itself if e ∈ Z.

    Any other result is a convex combination of vertices of Z, and so it is in Z, up to the rounding of a few sums. The
    method finds the nearest point of the convex hull of a few vertices, beginning with those nearest to e. Then it adds
    the vertex that is farthest in the direction from there to e, and repeats (Wolfe 1976: Finding the nearest point in
    a polytope, Mathematical Programming 11). That vertex also bounds how much nearer any other point can be.
    """

    errors: ErrorSet
    root: Array

    def __call__(self, e: Array) -> Array | None:
        """Return d (n,); None if it is not found up to `_GAP`. LinAlgError: not found in float64."""
        if self.errors.facets is not None and self.errors.contains(e):
            return e
        images, squares = self._images
        aim = self.root @ e
        begun = np.argsort(squares - images @ (2 * aim))[:_BEGUN]
        points, off = self.errors.vertices[begun], images[begun] - aim
        unit, least = float(np.max(np.abs(off))), float("inf")
        if not 0 < unit < np.inf:
            if unit == 0:
                return e
            raise np.linalg.LinAlgError("an error is beyond floating point")
        for _ in range(_MOST_ROUNDS):
            weights = _nearest_to_zero(off / unit)
            used = weights > 0
            points, off, weights = points[used], off[used], weights[used]
            nearest, towards = weights @ points, -weights @ off
            if self.errors.facets is None and np.max(np.abs(e - nearest) / self.errors.extents) <= _OF_LEAST_SQUARES:
                return e
            farthest = self.errors.farthest(self.root.T @ towards)
            image, distance = self.root @ farthest - aim, float(towards @ towards)
            gap = towards @ image + distance
            if gap <= _GAP * distance:
                return np.asarray(nearest)
            if not distance < least:  # rounding hides what is left of the gap
                return np.asarray(nearest) if gap <= _LEAST_GAP * unit**2 else None
            least = distance
            points, off = np.vstack([points, farthest]), np.vstack([off, image])
        return None

    @cached_property
    def _images(self) -> tuple[Array, Array]:
        """The images (v, n) of the vertices, and their squared lengths."""
        images = self.errors.vertices @ self.root.T
        return images, np.einsum("ij,ij->i", images, images)


def _nearest_to_zero(points: Array) -> Array:
    """Return the weights (p,) of the point of the convex hull of `points` that is nearest to zero.

    They are a multiple of the w ≥ 0 that minimise ‖Σ_i w_i points_i‖² + (1 − Σ_i w_i)². Raises LinAlgError if they are
    not found in float64.
    """
    rows = np.vstack([points.T, np.ones(len(points))])
    aim = np.zeros(len(rows))
    aim[-1] = 1.0
    weights = nonnegative_least_squares(rows, aim)
    return np.asarray(weights / np.sum(weights))
