"""The invariant set of the error in float64: half-spaces where it is a product of polygons, its summands elsewhere."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from math import comb

import numpy as np
import numpy.typing as npt
import scipy

from trackably.arrays import Array
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
