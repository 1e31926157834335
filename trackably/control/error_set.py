"""The invariant set of the error in float64, and its point that is nearest to another one."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from math import comb

import numpy as np
import numpy.typing as npt
import scipy

from trackably.arrays import Array
from trackably.gp.bounded.least_squares import nonnegative_least_squares
from trackably.systems.disturbance.invariant import InvariantSet
from trackably.systems.disturbance.rationals import as_array
from trackably.systems.disturbance.zonotope import Zonotope

_ROUNDING = 1e-12
"""Points beyond a side of the set by this part of its size along the coordinates of the side count as inside."""

_MOST_FACETS = 100_000

Places = npt.NDArray[np.intp]
"""Of coordinates."""


@dataclass(frozen=True, eq=False)
class ErrorSet:
    """Z of an invariant set: its parts ⊕_{i<N} A_Kⁱ W ⊕ A_Kᴺ (1 − α)⁻¹ ⊕_{i<s} A_Kⁱ P, summed in float64.

    It is `centre` ⊕ {Σ_j ξ_j g_j : |ξ_j| ≤ 1} ⊕ the convex hulls `hulls`: a zonotope where W is one. Where W is a
    convex hull, so is each A_Kⁱ W, and the generators g_j are those of P.
    """

    invariant: InvariantSet

    @property
    def dimension(self) -> int:
        return len(self.invariant.box)

    def contains(self, e: Array) -> bool:
        """Whether an error (n,) is in Z, up to rounding."""
        if self._sides is None:
            return self._weights(e) is not None
        rows, sides = self._sides
        return bool((rows @ e <= sides).all())

    @cached_property
    def _sides(self) -> tuple[Array, Array] | None:
        """Half-spaces with the rounding that counts as inside; None where there are none."""
        if (described := self.halfspaces or self._facets) is None:
            return None
        rows, sides = described
        return rows, sides + _ROUNDING * np.abs(rows) @ self._reach

    @cached_property
    def blocks(self) -> tuple[Places, ...]:
        """Sets of coordinates that have nothing to do with each other: Z is the product of its projections on them."""
        if len(self.hulls):
            return (np.arange(self.dimension),)
        used = (self.generators != 0).astype(int)
        count, labels = scipy.sparse.csgraph.connected_components(used.T @ used, directed=False)
        return tuple(np.flatnonzero(labels == block) for block in range(count))

    @cached_property
    def halfspaces(self) -> tuple[Array, Array] | None:
        """H (f, n) and h (f,) with Z = {e : H e ≤ h}, where no block has more than two coordinates; None elsewhere.

        Rows have unit length.
        """
        if max(map(len, self.blocks)) > 2:
            return None
        rows = np.vstack([self.normals(block) for block in self.blocks])
        return rows, self.support(rows)

    def normals(self, block: Places) -> Array:
        """Return the outward normals (f, n) of the sides of Z in one or two coordinates."""
        sides = np.array([[1.0], [-1.0]])
        if len(block) == 2:
            edges = np.array([edge for edge in self._edges(block) if edge.any()]).reshape(-1, 2)
            found = edges[:, ::-1] * [-1.0, 1.0] / np.linalg.norm(edges, axis=1, keepdims=True)
            sides = np.vstack([found, -found]) if len(found) else np.vstack([np.eye(2), -np.eye(2)])
            if len(found) and np.linalg.matrix_rank(found, tol=1e-9) < 2:  # a flat set has ends, too
                sides = np.vstack([sides, sides[:1, ::-1] * [1, -1], sides[:1, ::-1] * [-1, 1]])
        rows = np.zeros((len(sides), self.dimension))
        rows[:, block] = sides
        return rows

    def support(self, rows: Array) -> Array:
        """Return h_Z(row) for rows (…, n): shape (…)."""
        found = rows @ self.centre + np.abs(rows @ self.generators.T).sum(axis=-1)
        for hull in self.hulls:
            found = found + np.max(rows @ hull.T, axis=-1)
        return np.asarray(found)

    def farthest(self, row: Array) -> Array:
        """Return a point (n,) of Z at which row · e is largest, up to rounding."""
        found = self.centre + np.where(self.generators @ row >= 0, 1.0, -1.0) @ self.generators
        if len(self.hulls):
            found = found + self.hulls[np.arange(len(self.hulls)), np.argmax(self.hulls @ row, axis=1)].sum(axis=0)
        return np.asarray(found)

    def corners(self, block: Places) -> Array:
        """Return all vertices (v, 1 or 2) of Z in one or two coordinates, in turn: each is between two normals."""
        rows = self.normals(block)
        if len(block) == 2:
            angles = np.unique(np.arctan2(rows[:, block[1]], rows[:, block[0]]))
            between = (angles + np.append(angles[1:], angles[0] + 2 * np.pi)) / 2
            rows = np.zeros((len(between), self.dimension))
            rows[:, block] = np.column_stack([np.cos(between), np.sin(between)])
        return np.array([self.farthest(row)[block] for row in rows])

    @cached_property
    def extents(self) -> Array:
        """How far Z reaches along each axis (n,), none of them zero."""
        return np.where(self._reach > 0, self._reach, 1.0)

    @cached_property
    def _reach(self) -> Array:
        """How far Z reaches along each axis (n,): a set of {0} not at all."""
        axes = np.eye(self.dimension)
        return self.support(axes) + self.support(-axes)

    @cached_property
    def centre(self) -> Array:
        """The centre (n,) of the generators."""
        Z = self.invariant
        if not isinstance(Z.disturbance, Zonotope):
            return np.zeros(self.dimension)
        at, total = as_array([Z.disturbance.centre], self.dimension)[0], np.zeros(self.dimension)
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
        """The vertices (N, v, n) of A_Kⁱ W for i < N; none where W is a zonotope."""
        Z, W = self.invariant, self.invariant.disturbance
        if isinstance(W, Zonotope):
            return np.zeros((0, 1, self.dimension))
        found = [W.vertex_matrix]
        while len(found) < Z.head:
            found.append(found[-1] @ Z.closed_loop.T)
        return np.array(found)

    @cached_property
    def _facets(self) -> tuple[Array, Array] | None:
        """The same for others: a facet of a zonotope is spanned by n − 1 of its generators. None for too many.

        None also for a flat set, which has no facets.
        """
        G, n = self.generators, self.dimension
        if len(self.hulls) or comb(len(G), n - 1) > _MOST_FACETS or np.linalg.matrix_rank(G) < n:
            return None
        unit = G / np.linalg.norm(G, axis=1, keepdims=True)
        spanning = unit[np.array(list(combinations(range(len(G)), n - 1)))]
        minors = [(-1) ** i * np.linalg.det(np.delete(spanning, i, axis=2)) for i in range(n)]
        normals = np.stack(minors, axis=1)
        sizes = np.linalg.norm(normals, axis=1)
        rows = normals[sizes > _ROUNDING] / sizes[sizes > _ROUNDING, None]
        rows = np.vstack([rows, -rows])
        return rows, self.support(rows)

    def _edges(self, block: Places) -> Iterator[Array]:
        """Yield the directions (2,) of all edges in two coordinates, which are those of the summands."""
        Z = self.invariant
        if isinstance(Z.disturbance, Zonotope):
            yield from self.generators[:, block]
            return
        W, tail = Z.disturbance.vertex_matrix, np.diag(Z.box)
        edges = np.array([q - p for i, p in enumerate(W) for q in W[i + 1 :] if _is_edge(p, q, W)]).reshape(-1, 2)
        for i in range(Z.head + Z.terms):
            yield from edges if i < Z.head else tail
            edges, tail = edges @ Z.closed_loop.T, tail @ Z.closed_loop.T

    def _weights(self, e: Array) -> Array | None:
        """Return ξ with |ξ| ≤ 1, and weights of the hulls' vertices, that give e; None where there are none."""
        G, aim = self.generators.T, e - self.centre
        if not G.size and not self.hulls.size:
            return np.zeros(0) if np.all(np.abs(aim) <= _ROUNDING) else None
        found = self._inverse @ aim
        if not self.hulls.size and np.max(np.abs(found)) <= 1 and np.allclose(G @ found, aim, rtol=1e-9, atol=0):
            return np.asarray(found)
        N, v, n = self.hulls.shape
        matrix = np.column_stack([G, self.hulls.reshape(N * v, n).T])
        unit = np.maximum(np.abs(matrix).sum(axis=1), np.finfo(float).tiny)
        sums = np.column_stack([np.zeros((N, G.shape[1])), np.kron(np.eye(N), np.ones(v))])
        program = scipy.optimize.linprog(
            np.zeros(matrix.shape[1]),
            A_eq=np.vstack([matrix / unit[:, None], sums]),
            b_eq=np.append(aim / unit, np.ones(N)),
            bounds=[(-1, 1)] * G.shape[1] + [(0, 1)] * (N * v),
            method="highs",
        )
        return None if program.x is None else np.asarray(program.x)

    @cached_property
    def _inverse(self) -> Array:
        """The weights of least squares: those of most errors are less than one."""
        return np.asarray(np.linalg.pinv(self.generators.T))


def _is_edge(p: Array, q: Array, points: Array) -> bool:
    """Whether all points lie on one side of the line through p and q, which differ, up to rounding.

    A line beside the points does no harm: it is one more direction in which the set is bounded.
    """
    along = q - p
    sides = (points - p) @ np.array([-along[1], along[0]])
    least = _ROUNDING * np.max(np.abs(sides), initial=0.0)
    return bool(along.any() and (np.all(sides <= least) or np.all(sides >= -least)))


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


_PARALLEL, _SAME = 1e-9, 1e-12
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
        spanned = np.linalg.norm(normals, axis=1) > _PARALLEL * sizes
        pairs, first, second, normals = pairs[spanned], first[spanned], second[spanned], normals[spanned]
        heights = normals @ G.T
        # Of two that are nearly parallel the normal is so inexact that their own heights seem to differ from zero.
        np.put_along_axis(heights, pairs, 0.0, axis=1)
        most = np.linalg.norm(normals, axis=1)[:, None] * np.linalg.norm(G, axis=1)
        from_centre = np.where(np.abs(heights) > _PARALLEL * most, np.sign(heights), 0.0) @ G
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


_MISSED = 1e-9
"""A point is taken if it misses its rows, and the least distance, by no more than this part of the distance."""

_CONTRADICTION = 1e-14


def nearest_in(rows: Array, limits: Array, aim: Array) -> Array | None:
    """Return argmin ‖q − aim‖ with rows q ≤ limits, for rows (r, d) and aim (d,): shape (d,).

    None where the rows contradict each other. Its multipliers λ ≥ 0 with q = aim − rowsᵀ λ are found by an active-set
    method, from those u ≥ 0 that minimise ‖rowsᵀ u‖² + (1 − uᵀ excess)² (Lawson and Hanson 1974: Solving Least Squares
    Problems, chapter 23). Raises LinAlgError where they are not found in float64.
    """
    sizes = np.linalg.norm(rows, axis=1)
    sizes = np.where(sizes > 0, sizes, 1.0)
    rows, excess = rows / sizes[:, None], (rows @ aim - limits) / sizes
    unit = np.max(excess, initial=0.0)
    if not unit > 0:
        return aim
    excess = excess / unit
    u = nonnegative_least_squares(np.vstack([rows.T, excess]), np.append(np.zeros(len(aim)), 1.0))
    left = 1 - u @ excess
    if left <= _CONTRADICTION:
        return None
    multipliers = u / left
    move = -rows.T @ multipliers
    broken, squared = rows @ move + excess, move @ move
    if np.max(broken) > _MISSED or abs(multipliers @ broken) > _MISSED * squared:
        raise np.linalg.LinAlgError("the multipliers are not accurate")
    return np.asarray(aim + unit * move)


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
