"""Kernels that decay: samples far apart are uncorrelated, and the covariance matrix is a band matrix.

The samples are cut into blocks such that only neighbouring blocks are correlated. Then A is block tridiagonal and its
Cholesky factor is block bidiagonal. A gradient needs only the same blocks of A⁻¹, which one backward sweep computes
(K. Takahashi, J. Fagan, M.-S. Chin, 1973, in block form). The time is linear in the number of samples.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Self

import numpy as np
import scipy

from trackably.arrays import Array
from trackably.gp.factors.factorisation import Covariance, Factorisation
from trackably.gp.kernels.base import Kernel

_HALVINGS, _PARTS = 12, 16  # the shortest reach is span / 2^12; it is found up to a factor 2^(1/16)


class BlockRow(NamedTuple):
    """One block row of a symmetric block tridiagonal matrix: the `diagonal` block and the one to its right, `next`."""

    diagonal: Array
    next: Array


def blocks(times: Array, reach: float) -> list[slice]:
    """Cut increasing `times` [s] into blocks such that only neighbouring blocks have times within `reach` [s]."""
    cuts = [0]
    while (cut := int(np.searchsorted(times, times[cuts[-1]] + reach, side="right"))) < len(times):
        cuts.append(cut)
    return [slice(*pair) for pair in zip(cuts, [*cuts[1:], len(times)], strict=True)]


def reach(kernel: Kernel, span: float, negligible: float) -> float:
    """Return the distance [s] beyond which a kernel and its derivatives stay below `negligible`.

    The kernel must decrease (finite `decay_distance`). If there is no such distance, the result is at least `span`.
    """
    distances = span * 2.0 ** (-np.arange(_HALVINGS * _PARTS) / _PARTS)
    value, gradient = kernel.value_and_gradient(distances)
    matters = np.any(np.abs(np.concatenate([value[None], gradient])) > negligible, axis=0)
    first = int(np.argmax(matters)) if np.any(matters) else len(distances)
    return float(span * 2.0 ** ((1 - first) / _PARTS))


@dataclass(frozen=True)
class Band(Factorisation):
    """A = L Lᵀ: `factors` has L_ii, lower triangular, and L_ii⁻¹ A_{i,i+1} for each of the `rows` (blocks of samples).

    The last row's next block is empty. `gradient` has the blocks of ∂K: shapes (p, b_i, b_i) and (p, b_i, b_{i+1}).
    """

    rows: list[slice]
    factors: list[BlockRow]
    gradient: list[BlockRow]
    noise_variance: Array

    @classmethod
    def of(cls, times: Array, rows: list[slice], covariance: Covariance, noise_variance: Array) -> Self | None:
        """Factorise for n `times` [s] in blocks with noise variances (n,); None if A is not positive definite."""
        factors, gradient = list[BlockRow](), list[BlockRow]()
        for own, after in _with_next(rows):
            both = slice(own.start, after.stop)
            value, by_theta = covariance(times[own, None] - times[both])
            size = own.stop - own.start
            diagonal, beside = value[:, :size], value[:, size:]
            diagonal[np.diag_indices(size)] += noise_variance[own]
            if factors:
                diagonal -= factors[-1].next.T @ factors[-1].next
            factor, info = scipy.linalg.lapack.dpotrf(diagonal, lower=True)
            if info:
                return None
            factors.append(BlockRow(factor, _lower_solve(factor, beside)))
            gradient.append(BlockRow(by_theta[:, :, :size], by_theta[:, :, size:]))
        return cls(rows, factors, gradient, noise_variance)

    @cached_property
    def log_determinant(self) -> float:
        return 2 * float(sum(np.log(factor.diagonal.diagonal()).sum() for factor in self.factors))

    def solve(self, right: Array) -> Array:
        solution = np.array(right, dtype=float)
        before = None
        for rows, factor in zip(self.rows, self.factors, strict=True):
            if before is not None:
                solution[rows] -= before[1].next.T @ solution[before[0]]
            solution[rows] = _lower_solve(factor.diagonal, solution[rows])
            before = rows, factor
        for (rows, after), factor in zip(reversed(list(_with_next(self.rows))), reversed(self.factors), strict=True):
            solution[rows] -= factor.next @ solution[after]
            solution[rows] = _lower_solve(factor.diagonal, solution[rows], transposed=True)
        return solution

    def gradient_times(self, c: Array) -> Array:
        product = np.zeros((len(self.gradient[0].diagonal), len(c)))
        for (rows, after), gradient in zip(_with_next(self.rows), self.gradient, strict=True):
            product[:, rows] += gradient.diagonal @ c[rows] + gradient.next @ c[after]
            product[:, after] += c[rows] @ gradient.next
        return product

    def likelihood_traces(self, c: Array) -> tuple[Array, float]:
        by_kernel, by_noise = np.zeros(len(self.gradient[0].diagonal)), np.zeros(())
        for (rows, after), inverse, gradient in zip(_with_next(self.rows), self._inverse, self.gradient, strict=True):
            diagonal = inverse.diagonal - c[rows, None] * c[rows]
            beside = inverse.next - c[rows, None] * c[after]
            by_kernel += np.einsum("pij,ij->p", gradient.diagonal, diagonal)
            by_kernel += 2 * np.einsum("pij,ij->p", gradient.next, beside)
            by_noise += diagonal.diagonal() @ self.noise_variance[rows]
        return by_kernel, float(by_noise)

    @cached_property
    def _inverse(self) -> list[BlockRow]:
        """The blocks of A⁻¹.

        With G = L_ii⁻ᵀ L_ii⁻¹ A_{i,i+1} they are Z_{i,i+1} = −G Z_{i+1,i+1} and
        Z_ii = (L_ii L_iiᵀ)⁻¹ − Z_{i,i+1} Gᵀ.
        """
        found, after = list[BlockRow](), np.empty((0, 0))
        for factor in reversed(self.factors):
            inverse, _ = scipy.linalg.lapack.dpotri(factor.diagonal, lower=True)
            inverse = np.tril(inverse) + np.tril(inverse, -1).T
            g = _lower_solve(factor.diagonal, factor.next, transposed=True)
            beside = -g @ after
            after = inverse - beside @ g.T
            found.append(BlockRow(after, beside))
        return found[::-1]


def _with_next(rows: list[slice]) -> Iterator[tuple[slice, slice]]:
    """Yield each block with the next one, and the last block with an empty slice."""
    end = rows[-1].stop
    return zip(rows, [*rows[1:], slice(end, end)], strict=True)


def _lower_solve(factor: Array, right: Array, transposed: bool = False) -> Array:
    """Return L⁻¹ r, or L⁻ᵀ r if `transposed`; LAPACK refuses an empty r, which is returned as it is."""
    if not right.size:
        return right
    solution, _ = scipy.linalg.lapack.dtrtrs(factor, right, lower=True, trans=transposed)
    return np.asarray(solution.reshape(right.shape))
