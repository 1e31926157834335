"""Kernels that decay: far samples know nothing of each other, and the covariance matrix is a band.

With samples in blocks such that only neighbouring blocks are correlated, A is block tridiagonal. Its Cholesky factor
is block bidiagonal, and of A⁻¹ a gradient asks no more than the same blocks, which one sweep backwards computes
(K. Takahashi, J. Fagan, M.-S. Chin, 1973, in its form for blocks). The time is linear in the number of samples.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Self

import numpy as np
from scipy.linalg import lapack

from trackable.arrays import Array
from trackable.gp.factors.factored import Covariance, Factored
from trackable.gp.kernels.base import Kernel

_HALVINGS, _PARTS = 12, 16  # of the span: how short a reach can be, and how closely it is found


class Row(NamedTuple):
    """One block of samples: its own `diagonal` part of a symmetric matrix, and that with the `next` block."""

    diagonal: Array
    next: Array


def blocks(times: Array, reach: float) -> list[slice]:
    """Increasing `times` [s] cut so that those in blocks that are no neighbours lie more than `reach` [s] apart."""
    cuts = [0]
    while (cut := int(np.searchsorted(times, times[cuts[-1]] + reach, side="right"))) < len(times):
        cuts.append(cut)
    return [slice(*pair) for pair in zip(cuts, [*cuts[1:], len(times)], strict=True)]


def reach(kernel: Kernel, span: float, negligible: float) -> float:
    """The distance [s] beyond which a kernel that falls (with a finite ζ) and its derivatives are `negligible`.

    At least `span` where they are not.
    """
    distances = span * 2.0 ** (-np.arange(_HALVINGS * _PARTS) / _PARTS)
    value, gradient = kernel.value_and_gradient(distances)
    felt = np.any(np.abs(np.concatenate([value[None], gradient])) > negligible, axis=0)
    first = int(np.argmax(felt)) if np.any(felt) else len(distances)
    return float(span * 2.0 ** ((1 - first) / _PARTS))


@dataclass(frozen=True)
class Band(Factored):
    """A = L Lᵀ: `factors` has L_ii, lower triangular, and L_ii⁻¹ A_{i,i+1} for each of the `rows` (blocks of samples).

    The last row's next block is empty. `gradient` has the blocks of ∂K: shapes (p, b_i, b_i) and (p, b_i, b_{i+1}).
    """

    rows: list[slice]
    factors: list[Row]
    gradient: list[Row]
    noise_variance: Array

    @classmethod
    def of(cls, times: Array, rows: list[slice], covariance: Covariance, noise_variance: Array) -> Self | None:
        """From n `times` [s] in blocks, each sample's own noise (n,); None where A is not positive definite."""
        factors, gradient = list[Row](), list[Row]()
        for own, after in _with_next(rows):
            both = slice(own.start, after.stop)
            value, by_theta = covariance(times[own, None] - times[both])
            size = own.stop - own.start
            diagonal, beside = value[:, :size], value[:, size:]
            diagonal[np.diag_indices(size)] += noise_variance[own]
            if factors:
                diagonal -= factors[-1].next.T @ factors[-1].next
            factor, info = lapack.dpotrf(diagonal, lower=True)
            if info:
                return None
            factors.append(Row(factor, _lower_solve(factor, beside)))
            gradient.append(Row(by_theta[:, :, :size], by_theta[:, :, size:]))
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

    def contracted(self, c: Array) -> tuple[Array, float]:
        by_kernel, by_noise = np.zeros(len(self.gradient[0].diagonal)), np.zeros(())
        for (rows, after), inverse, gradient in zip(_with_next(self.rows), self._inverse, self.gradient, strict=True):
            diagonal = inverse.diagonal - c[rows, None] * c[rows]
            beside = inverse.next - c[rows, None] * c[after]
            by_kernel += np.einsum("pij,ij->p", gradient.diagonal, diagonal)
            by_kernel += 2 * np.einsum("pij,ij->p", gradient.next, beside)
            by_noise += diagonal.diagonal() @ self.noise_variance[rows]
        return by_kernel, float(by_noise)

    @cached_property
    def _inverse(self) -> list[Row]:
        """The blocks of A⁻¹.

        With G = L_ii⁻ᵀ L_ii⁻¹ A_{i,i+1} they are Z_{i,i+1} = −G Z_{i+1,i+1} and
        Z_ii = (L_ii L_iiᵀ)⁻¹ − Z_{i,i+1} Gᵀ.
        """
        found, after = list[Row](), np.empty((0, 0))
        for factor in reversed(self.factors):
            inverse, _ = lapack.dpotri(factor.diagonal, lower=True)
            inverse = np.tril(inverse) + np.tril(inverse, -1).T
            g = _lower_solve(factor.diagonal, factor.next, transposed=True)
            beside = -g @ after
            after = inverse - beside @ g.T
            found.append(Row(after, beside))
        return found[::-1]


def _with_next(rows: list[slice]) -> Iterator[tuple[slice, slice]]:
    """Each block with the one that follows; the last one with none."""
    end = rows[-1].stop
    return zip(rows, [*rows[1:], slice(end, end)], strict=True)


def _lower_solve(factor: Array, right: Array, transposed: bool = False) -> Array:
    """L⁻¹ r or L⁻ᵀ r; of nothing, nothing."""
    if not right.size:
        return right
    solution, _ = lapack.dtrtrs(factor, right, lower=True, trans=transposed)
    return np.asarray(solution.reshape(right.shape))
