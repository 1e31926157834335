"""What a nominal start costs where no bound is active: a quadratic function of it."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from trackably.arrays import Array
from trackably.control.step.linear_quadratic import LinearQuadratic

_SMALLEST = 1e-6
"""A start whose cost is flatter in a direction than this part of its steepest has no optimum in float64."""


@dataclass(frozen=True, eq=False)
class StartCost:
    """V(e(0)) = ‖root (e(0) − e*)‖² + const: the optimal cost without bounds, as a function of the start, all scaled.

    The cheapest start e* is linear in the defects; it is the reference itself where there are none.
    """

    optimum: LinearQuadratic

    @property
    def root(self) -> Array:
        """An upper triangular matrix (n, n)."""
        return self._factors[1]

    @cached_property
    def is_strict(self) -> bool:
        """Whether every other start than e* costs more, in float64."""
        sizes = np.linalg.svd(self.root, compute_uv=False)
        return bool(np.all(np.isfinite(sizes)) and sizes[-1] > _SMALLEST * sizes[0])

    def cheapest(self, defects: Array) -> Array:
        """Return e* (n,) for defects (N, n)."""
        return np.asarray(self._of_defects @ defects.ravel())

    @cached_property
    def _of_defects(self) -> Array:
        orthogonal, root = self._factors
        return np.asarray(-scipy.linalg.solve_triangular(root, orthogonal.T @ self._weighted(self.optimum.model.drift)))

    @cached_property
    def _factors(self) -> tuple[Array, Array]:
        n = len(self.optimum.Q)
        stacked = np.vstack([square_root(self.optimum.Q), self._weighted(self.optimum.model.free)])
        orthogonal, root = np.linalg.qr(stacked)
        return np.asarray(orthogonal[n:]), np.asarray(root)

    def _weighted(self, unforced: Array) -> Array:
        """Return weighted errors e(1), …, e(N − 1) and inputs for columns of unforced errors (N n, …)."""
        n, gain = len(self.optimum.Q), self.optimum.gain
        v = gain @ unforced
        e = (unforced + self.optimum.model.forced @ v)[:-n]
        Q, R = square_root(self.optimum.Q), square_root(self.optimum.R)
        by_step = [
            np.einsum("ab,ibc->iac", root, of.reshape(-1, len(root), of.shape[1])) for root, of in ((Q, e), (R, v))
        ]
        return np.vstack([of.reshape(-1, unforced.shape[1]) for of in by_step])


def square_root(weight: Array) -> Array:
    """Return S (n, n) with Sᵀ S = `weight`, which is positive semidefinite."""
    values, vectors = np.linalg.eigh(weight)
    return np.asarray(np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T)
