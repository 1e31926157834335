"""Quadratic programs of a few variables d and one slack s, solved by their duals:

    min ½ dᵀ B d + cᵀ d + ρ (s + s²/2)   subject to   g + J d + s ≥ 0,   s ≥ 0,   lower ≤ d ≤ upper.

With z = (d, s), H = diag(B, ρ) = L Lᵀ, h = (c, ρ) and y = Lᵀ z + L⁻¹ h this asks for the shortest y in a polyhedron.
"""

from typing import NamedTuple, Self

import numpy as np
import numpy.typing as npt
import scipy
from scipy.linalg.lapack import dpotrf, dtrtri

from trackably.arrays import Array

FEASIBLE = 1e-12
_PIVOTS = 100  # for each row of a quadratic program: SciPy's own 3 are too few where bounds nearly coincide

_ONE = np.ones(1)

Indices = npt.NDArray[np.intp]


class QuadraticProgram(NamedTuple):
    """A quadratic program in d, shape (p,), for all g, shape (m,), and penalties ρ: B is factored once.

    `inverse` is that of the Cholesky factor of B, `shift` is its product with c, and `newton` is −B⁻¹ c. Each of the m
    constraints can change by `reach` within the box.
    """

    jacobian: Array
    lower: Array
    upper: Array
    inverse: Array
    shift: Array
    newton: Array
    reach: Array

    @classmethod
    def of(cls, curvature: Array, gradient: Array, jacobian: Array, lower: Array, upper: Array) -> Self:
        """Factor B = `curvature`, which is positive definite; c is the `gradient`."""
        root, info = dpotrf(curvature, lower=True)
        assert info == 0, "the curvature is positive definite"
        inverse, _ = dtrtri(root, lower=True)
        shift = inverse.dot(gradient)
        reach = np.abs(jacobian).dot(np.maximum(-lower, upper))
        return cls(jacobian, lower, upper, inverse, shift, -shift.dot(inverse), reach)

    def solve(self, slack: Array, penalty: float) -> tuple[Array, Array]:
        """Return d and the multipliers of the constraints for g = `slack`: Newton's step where it keeps all of them."""
        multipliers = np.zeros(len(slack))
        if self._room(slack, self.newton).min() >= 0:
            return self.newton, multipliers
        near = (slack < self.reach).nonzero()[0]  # no step can violate the others
        polyhedron, m = self._polyhedron(slack, near, penalty), len(near)
        normals, u = polyhedron[:-2], _of_the_shortest(polyhedron)
        multipliers[near] = u[:m]
        d = (normals.dot(u) - self.shift).dot(self.inverse)
        if u[m] > 0:  # s = 0: all can be kept
            d = self._mended(d, slack, near, normals, u > 0)
        return np.minimum(np.maximum(d, self.lower), self.upper), multipliers

    def _room(self, slack: Array, d: Array) -> Array:
        """Return by how much d keeps each constraint and each end of the box, where s = 0."""
        return np.concatenate([slack + self.jacobian.dot(d), d - self.lower, self.upper - d])

    def _polyhedron(self, slack: Array, near: Indices, penalty: float) -> Array:
        """Return (N; bᵀ) of Nᵀ y ≥ b: of the constraints `near`, of s ≥ 0, of d ≥ lower and of −d ≥ −upper."""
        m, p = len(near), len(self.shift)
        found = np.zeros((p + 2, m + 1 + 2 * p))
        normals, offsets = found[:p], found[-1]
        normals[:, :m] = self.inverse.dot(self.jacobian[near].T)
        normals[:, m + 1 : -p], normals[:, -p:] = self.inverse, -self.inverse
        found[p, : m + 1] = penalty**-0.5
        np.concatenate([1.0 - slack[near], _ONE, self.lower, -self.upper], out=offsets)
        offsets += self.shift.dot(normals)
        return found

    def _mended(self, d: Array, slack: Array, near: Indices, normals: Array, held: npt.NDArray[np.bool_]) -> Array:
        """Add what d lacks where it misses a constraint: rounding in flat directions, which no higher penalty mends."""
        room, ends = self._room(slack, d), -2 * len(d)
        room = np.concatenate([room[near], [0.0], room[ends:]])
        if room.min() >= -FEASIBLE:
            return d
        move, *_ = np.linalg.lstsq(normals[:, held].T, -room[held])
        return np.asarray(d + move.dot(self.inverse))


def _of_the_shortest(polyhedron: Array) -> Array:
    """Return u ≥ 0 for which y = N u is the shortest y with Nᵀ y ≥ b, from (N; bᵀ), of which b is overwritten.

    It follows from the residual of min ‖(N; bᵀ) u − (0; 1)‖ over u ≥ 0 (Lawson and Hanson).
    """
    offsets, unit = polyhedron[-1], np.zeros(len(polyhedron))
    unit[-1] = 1.0
    scale = max(1.0, np.abs(offsets).max().item())
    offsets /= scale  # y in units of its own size
    u, _ = scipy.optimize.nnls(polyhedron, unit, maxiter=_PIVOTS * offsets.size)
    return np.asarray(u * (scale / (1.0 - offsets.dot(u))))
