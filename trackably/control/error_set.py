"""The set of errors between a measured state and the first state of a plan."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import islice

import numpy as np
from scipy.optimize import lsq_linear

from trackably.arrays import Array
from trackably.systems.disturbances import Zonotope
from trackably.systems.tightening import InvariantSet, powers

_ROUNDING = 1e-10
"""A point counts as in Z if it is off a point of Z by no more than this part of the width of Z along each axis."""

_STEPS, _LEAST = 8, 1e-9  # steps of the weighted least squares; least |row · direction|, relative to the largest
_CONVERGED = 1e-15  # tolerance of SciPy's search for the least squares


@dataclass(frozen=True, eq=False)
class ErrorSet:
    """The set Z of all errors `centre` + p · `directions` with `lower` ≤ p ≤ 1 and `sums` p = 1, in float64.

    The shapes are (n,), (q, n), (q,) and (h, q). The numbers p are multiples of generators of a zonotope, which are −1
    at least, and shares of the vertices of h convex hulls, which are 0 at least and add up to 1 for each hull.
    """

    centre: Array
    directions: Array
    lower: Array
    sums: Array

    @classmethod
    def zero(cls, n: int) -> ErrorSet:
        """Return the set {0}, for plans that start at the measured state, which has n coordinates."""
        return cls(np.zeros(n), np.zeros((0, n)), np.zeros(0), np.zeros((0, 0)))

    @classmethod
    def of(cls, invariant: InvariantSet) -> ErrorSet:
        """Return Z = ⊕_{i<N} A_Kⁱ W ⊕ A_Kᴺ (1 − α)⁻¹ ⊕_{i<s} A_Kⁱ P of an `InvariantSet`, which defines N, α, s and P.

        A_K is the closed loop, W the disturbance set and P a box. If W is a zonotope, all of Z is one, and there are no
        hulls. If W is a convex hull, each A_Kⁱ W is one of the hulls, relative to the mean of its vertices.
        """
        Z, W, n = invariant, invariant.disturbance, len(invariant.box)
        of_box = powers(np.diag(Z.box) / (1 - Z.contraction), Z.closed_loop.T)
        tail = np.array([*islice(of_box, Z.head, Z.head + Z.terms)])
        head = np.array([*islice(powers(W.matrix, Z.closed_loop.T), Z.head)])
        if isinstance(W, Zonotope):  # `head` has centres and generators
            centres, of_zonotopes, hulls = head[:, 0], [head[:, 1:], tail], head[:0]
        else:  # `head` has vertices
            centres, of_zonotopes = head.mean(axis=1), [tail]
            hulls = head - centres[:, None]
        generators = np.vstack([of.reshape(-1, n) for of in of_zonotopes])
        generators = generators[np.any(generators != 0, axis=1)]
        count, vertices, _ = hulls.shape
        return cls(
            centre=centres.sum(axis=0),
            directions=np.vstack([generators, hulls.reshape(-1, n)]),
            lower=np.repeat([-1.0, 0.0], [len(generators), count * vertices]),
            sums=np.hstack([np.zeros((count, len(generators))), np.kron(np.eye(count), np.ones(vertices))]),
        )

    def contains(self, e: Array) -> bool:
        """Whether an error e (n,) is in Z, up to rounding: whether `centre` + p · `directions` = e for an admissible p.

        Iteratively reweighted least squares: each step weights the directions by 1 / |row · direction|, with the row
        that the step before has found. The rows tend to that with the largest row · e / h_Z(row), and p to that of
        least size. If a few such steps decide nothing, p is found by least squares within its bounds, which takes long
        outside of Z.
        """
        off, shape = (e - self.centre) / self._extents, self.directions.T / self._extents[:, None]
        reached = np.ones(len(self.directions))
        for _ in range(_STEPS):
            row = np.linalg.lstsq(shape / reached @ shape.T, off)[0] / self._extents
            if row @ e - self.support(row) > _ROUNDING * np.abs(row) @ self._extents:
                return False
            sizes, p = np.abs(self.directions @ row), self.directions @ row / reached
            missed = np.abs(shape @ p - off)  # it is large if Z is flat and e lies beside it
            if not len(self.sums) and np.all(sizes <= reached) and np.all(missed <= _ROUNDING):
                return True
            reached = np.maximum(sizes / (np.max(sizes) or 1.0), _LEAST)
        rows, aim = np.vstack([shape, self.sums]), np.append(off, np.ones(len(self.sums)))
        found = lsq_linear(rows, aim, (self.lower, np.ones_like(self.lower)), method="bvls", tol=_CONVERGED)
        return bool(np.all(np.abs(found.fun) <= _ROUNDING))

    def support(self, rows: Array) -> Array:
        """Return h_Z(row) for rows (…, n); the result has shape (…)."""
        reached = rows @ self.directions.T
        of_generators = np.abs(reached[..., self.lower < 0]).sum(axis=-1)
        of_hulls = np.where(self.sums > 0, reached[..., None, :], -np.inf).max(axis=-1, initial=-np.inf).sum(axis=-1)
        return np.asarray(rows @ self.centre + of_generators + of_hulls)

    @cached_property
    def _extents(self) -> Array:
        """The width of the set along each axis (n,); 1 where it is zero."""
        axes = np.eye(len(self.centre))
        reach = self.support(axes) + self.support(-axes)
        return np.where(reach > 0, reach, 1.0)
