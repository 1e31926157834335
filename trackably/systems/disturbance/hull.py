"""Disturbance sets that are the convex hulls of their vertices; bounded half-spaces are converted to them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import combinations
from typing import TYPE_CHECKING, Self

import numpy as np
from flint import fmpq, fmpq_mat

from trackably.arguments import numbers
from trackably.arrays import Array, ArrayLike
from trackably.systems.disturbance.rationals import Vector, as_array, printed, vectors, whole
from trackably.systems.flat.rationals import fraction
from trackably.systems.formulas.ratios import as_fmpq
from trackably.systems.sets.polytope import Polytope

_MOST_CANDIDATES = 200_000


@dataclass(frozen=True)
class ConvexHull:
    """The convex hull of `vertices`, exactly: each float64 that is given counts as it is.

    Points that are no vertices do no harm. ValueError: shapes do not fit, there is no vertex, or a number is not
    finite.
    """

    vertices: tuple[Vector, ...]

    if TYPE_CHECKING:  # rationals are made of what is given

        def __init__(self, vertices: ArrayLike | Sequence[Sequence[Fraction]]) -> None: ...

    def __post_init__(self) -> None:
        object.__setattr__(self, "vertices", vectors("disturbance: vertices", self.vertices))

    @classmethod
    def halfspaces(cls, H: ArrayLike, h: ArrayLike) -> Self:
        """Return the bounded set {w : H w ≤ h} with H (r, n) and h (r,), by its exact vertices.

        ValueError: the set is unbounded, empty or without an interior (use `Zonotope` for flat sets), shapes do not
        fit, or n of r rows can be chosen in too many ways.
        """
        Polytope.halfspaces(H, h)  # says what is wrong
        rows, sides = numbers("disturbance: H", H), numbers("disturbance: h", h)
        found = dict.fromkeys(_vertices(rows, sides))
        if not found:
            raise ValueError("disturbance: H w ≤ h must be bounded: no vertex was found")
        return cls([list(vertex) for vertex in found])

    @property
    def dimension(self) -> int:
        return len(self.vertices[0])

    @cached_property
    def denominator(self) -> int:
        """The least d that makes all entries of d · W whole."""
        return self._whole[0]

    def whole_support(self, row: Sequence[int]) -> int:
        """Return d h_W(row), exactly, for the denominator d."""
        return max(sum(v * r for v, r in zip(vertex, row, strict=True)) for vertex in self._whole[1])

    def support(self, rows: Array) -> Array:
        """Return h_W(row) = max {row · w : w ∈ W} in float64 for rows (…, n): shape (…)."""
        return np.asarray(np.max(np.asarray(rows) @ self.vertex_matrix.T, axis=-1))

    @cached_property
    def vertex_matrix(self) -> Array:
        """The vertices in float64, shape (v, n)."""
        return as_array(self.vertices, self.dimension)

    def farthest(self, row: Array) -> Array:
        """Return a vertex (n,), up to rounding, at which row · w is largest."""
        return np.asarray(self.vertex_matrix[int(np.argmax(self.vertex_matrix @ row))])

    def draw(self, rng: np.random.Generator) -> Array:
        """Return a point (n,) of the set, up to rounding."""
        return np.asarray(rng.dirichlet(np.ones(len(self.vertices))) @ self.vertex_matrix)

    def scaled(self, factor: Fraction) -> Self:
        """Return factor · W."""
        return type(self)([[factor * value for value in vertex] for vertex in self.vertices])

    @cached_property
    def _whole(self) -> tuple[int, list[list[int]]]:
        return whole(self.vertices)

    def __repr__(self) -> str:
        return f"ConvexHull({printed(self.vertices)})"

    def __str__(self) -> str:
        return f"a polytope with {len(self.vertices)} vertices"


def _vertices(H: Array, h: Array) -> Iterator[Vector]:
    """Yield every point at which n rows that are independent hold with equality, and all others hold: in rationals."""
    r, n = H.shape
    exact = [[as_fmpq(v) for v in (*row, side)] for row, side in zip(H.tolist(), h.tolist(), strict=True)]
    candidates = combinations(range(r), n)
    for count, chosen in enumerate(candidates):
        if count >= _MOST_CANDIDATES:
            raise ValueError(
                f"disturbance: {r} rows in {n} dimensions have too many vertices; give these, or fewer rows"
            )
        matrix = fmpq_mat(n, n, [exact[i][j] for i in chosen for j in range(n)])
        if matrix.det() == 0:
            continue
        point = matrix.solve(fmpq_mat(n, 1, [exact[i][n] for i in chosen]))
        entries = [point[j, 0] for j in range(n)]
        if all(sum((a * x for a, x in zip(row, entries, strict=False)), fmpq(0)) <= row[n] for row in exact):
            yield tuple(fraction(entry) for entry in entries)
