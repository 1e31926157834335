"""The facets and edges of an error set that is a zonotope of three coordinates, and its point nearest to another."""

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np

from trackably.arrays import Array
from trackably.control.tube.error_set import ErrorSet

_FLAT, _SAME = 1e-9, 1e-12
_MOST_GENERATORS = 70


@dataclass(frozen=True, eq=False)
class Faces:
    """Facets that two generators g_i and g_j span, at `c` ± Σ_k ± g_k for the others, and their edges.

    Where more than two generators lie in a plane, facets are larger than those found here: what is found nearest has to
    be checked. Distances are ‖root (e − d)‖.
    """

    errors: ErrorSet
    root: Array

    @classmethod
    def of(cls, errors: ErrorSet, root: Array) -> "Faces | None":
        """Return the faces of a set; None where it is no such zonotope, or has too many."""
        if errors.dimension != 3 or len(errors.hulls) or not 3 <= len(errors.generators) <= _MOST_GENERATORS:
            return None
        return cls(errors, root)

    def nearest(self, e: Array) -> Array:
        """Return the nearest point of all facets and edges to e (3,); e itself where it lies behind all facets."""
        rows, offsets, centres, first, second = self._facets
        aim = self.root @ e
        outward, s, t = (rows @ aim - offsets).reshape(3, -1)
        if (outward <= 0).all():
            return e
        before = (outward > 0) & (np.abs(s) <= 1) & (np.abs(t) <= 1)
        at = int(before.argmax())
        if before[at]:
            return np.asarray(centres[at] + s[at] * first[at] + t[at] * second[at])
        starts, edges, image_starts, image_edges, along, squares = self._edges
        towards = image_edges @ aim - along  # (aim − start) · edge
        part = np.minimum(np.maximum(towards / squares, 0.0), 1.0)
        distances = self._start_squares - 2 * (image_starts @ aim) + part * (part * squares - 2 * towards)
        at = int(distances.argmin())
        return np.asarray(starts[at] + part[at] * edges[at])

    @cached_property
    def _facets(self) -> tuple[Array, Array, Array, Array, Array]:
        """Rows (3 F, 3) and offsets (3 F,) of how far an image lies outward, and of its coordinates in the facet.

        Then centres and both generators, (F, 3) each.
        """
        G = self.errors.generators
        pairs = np.array(list(combinations(range(len(G)), 2)))
        first, second = G[pairs[:, 0]], G[pairs[:, 1]]
        normals = np.cross(first, second)
        sizes = np.linalg.norm(first, axis=1) * np.linalg.norm(second, axis=1)
        spanned = np.linalg.norm(normals, axis=1) > _FLAT * sizes
        pairs, first, second, normals = pairs[spanned], first[spanned], second[spanned], normals[spanned]
        heights = normals @ G.T
        # Of two that are nearly parallel the normal is so inexact that their own heights seem to differ from zero.
        np.put_along_axis(heights, pairs, 0.0, axis=1)
        most = np.linalg.norm(normals, axis=1)[:, None] * np.linalg.norm(G, axis=1)
        from_centre = np.where(np.abs(heights) > _FLAT * most, np.sign(heights), 0.0) @ G
        centres = np.vstack([self.errors.centre + from_centre, self.errors.centre - from_centre])
        outward = np.vstack([normals, -normals]) @ np.linalg.inv(self.root)
        first, second = np.vstack([first, first]), np.vstack([second, second])
        within = np.linalg.pinv(np.stack([first @ self.root.T, second @ self.root.T], axis=2))
        rows = np.vstack([outward, within[:, 0], within[:, 1]])
        offsets = np.einsum("ij,ij->i", rows, np.tile(centres @ self.root.T, (3, 1)))
        return rows, offsets, centres, first, second

    @cached_property
    def _edges(self) -> tuple[Array, Array, Array, Array, Array, Array]:
        """Starts and directions of all edges (E, 3), their images, start · edge and the squared lengths of these."""
        _, _, centres, first, second = self._facets
        sides = [(-a + sign * b, 2 * a) for a, b in ((first, second), (second, first)) for sign in (1, -1)]
        starts = np.vstack([centres + off for off, _ in sides])
        edges = np.vstack([edge for _, edge in sides])
        ends = np.round(np.hstack([starts, edges]) / (_SAME * np.tile(self.errors.extents, 2)))
        _, chosen = np.unique(ends, axis=0, return_index=True)  # an edge belongs to two facets
        starts, edges = starts[chosen], edges[chosen]
        image_starts, image_edges = starts @ self.root.T, edges @ self.root.T
        along = np.einsum("ij,ij->i", image_starts, image_edges)
        return starts, edges, image_starts, image_edges, along, np.einsum("ij,ij->i", image_edges, image_edges)

    @cached_property
    def _start_squares(self) -> Array:
        return np.asarray(np.einsum("ij,ij->i", self._edges[2], self._edges[2]))
