"""Quasiseparable matrices: samples are in blocks, and their covariances with later blocks pass through a small state.

The covariance of block i with a later block k is

    A_ki = P_k Φ_{k−1} ⋯ Φ_{i+1} Q_i.

Q_i maps values at the samples of block i to the state after this block, Φ_j maps the state before block j to the state
after it, and P_k maps the state before block k to values at its samples.

Two kinds of covariances have this form:

- polynomials in λ|r| times e^(−λ|r|), and sums of them (Matérn kernels). As a function of the later time, the
  covariance with a sample is such a polynomial, and the state holds its coefficients. Φ takes them to a later time;
- covariances that are lost in rounding beyond some distance. If no block is shorter than this distance, only
  neighbouring blocks are correlated. The state is the covariance with each sample of the next block, and Φ is zero.

Rows are weighted sums of values at several instants, as samples are. They need both kinds: the covariance of two rows
is a polynomial times e^(−λ|r|) only if all instants of one row lie after those of the other. So the state also
has the covariances with those rows of the next block that begin before the last instant of this block.

Time and memory are linear in the number of samples. As in a dense Cholesky factorisation, only covariances of samples
given all earlier ones are factorised, and rounding errors are of the same size. (D. Foreman-Mackey, E. Agol, S.
Ambikasaran and R. Angus: Fast and scalable Gaussian process modeling with applications to astronomical time series,
Astron. J. 154 (2017), for blocks of one sample.)
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Self

import numpy as np
import scipy

from trackably.arrays import Array
from trackably.gp.factors.factorisation import Factorisation, cholesky_solve
from trackably.gp.kernels.base import Decay
from trackably.gp.rows import Terms
from trackably.gp.stencil import Covariance


def blocks(times: Array, reach: float, fewest: int = 1) -> list[slice]:
    """Cut increasing `times` [s] into blocks of at least the `fewest` samples, except for the last one.

    Times that are at most `reach` [s] apart lie in the same block or in neighbouring blocks.
    """
    cuts = [0]
    while (cut := max(int(np.searchsorted(times, times[cuts[-1]] + reach, "right")), cuts[-1] + fewest)) < len(times):
        cuts.append(cut)
    return [slice(*pair) for pair in zip(cuts, [*cuts[1:], len(times)], strict=True)]


class Block(NamedTuple):
    """The b samples in `rows`: their covariances, and their links with the states before and after the block.

    `own` is A_ii without noise. `into` is Q_i, from the samples to the state after the block, of size r. Both hold
    values, followed by each ∂/∂ln θ_j; shapes (1 + p, b, b) and (1 + p, r, b). `out` is P_i (b, q), from the state
    before the block, of size q, to the samples. `move` is Φ_i (r, q), from the state before to the state after: the
    samples of the block add nothing to it.
    """

    rows: slice
    own: Array
    into: Array
    out: Array
    move: Array


def row_blocks(
    terms: Terms, cuts: list[slice], tails: Sequence[Decay], covariance: Covariance | None = None
) -> list[Block]:
    """Return the covariances of rows, weighted sums of values of a process, in the blocks `cuts`.

    Rows have `terms`, at least one each, and are in the order of their first times. The kernel is the sum of `tails`
    (polynomials times e^(−λ|r|)). Without tails, only neighbouring blocks covary, and `covariance` gives that of two
    instants.
    """

    def of_instants(r: Array) -> Array:
        """Return the covariances of instants r [s] apart, then each ∂/∂ln θ_j: shape (1 + p, *r.shape)."""
        if covariance is None:
            return np.asarray(sum(np.tensordot(tail.coefficients, tail.values(np.abs(r)), 1) for tail in tails))
        value, gradient = covariance(r)
        return np.concatenate([value[None], gradient])

    stops = [row.stop for row in cuts]
    t, weights = terms.by_row(stops[-1])
    first, last = np.min(t, axis=1), [np.max(t[row]) for row in cuts]
    near = np.clip(np.searchsorted(first, last) if tails else len(t), stops, [*stops[1:], len(t)]) - stops
    begins = first[[row.start for row in cuts]]
    ends, of_block = np.append(begins[1:], np.max(t)), np.repeat(np.arange(len(begins)), np.diff(stops, prepend=0))
    moves = np.zeros((len(begins), *[sum(tail.size for tail in tails)] * 2))
    seen, by_tail, j = [np.empty((len(t), 0))], list[Array](), 0
    for tail in tails:
        size = slice(j, j := j + tail.size)
        moves[:, size, size] = np.moveaxis(tail.moved(ends - begins), -1, 0)
        seen.append(np.einsum("nj,snj->ns", weights, tail.values(t - begins[of_block, None])))
        moved = np.einsum("nj,ksnj->ksn", weights, tail.moved(ends[of_block, None] - t))
        by_tail.append(np.einsum("ps,ksn->pkn", tail.coefficients, moved))
    by_tails, found = np.hstack(seen), list[Block]()
    for row, after, before, move in zip(cuts, near, np.append(0, near), moves, strict=False):
        until = slice(row.start, row.stop + after)
        both = _covariances(of_instants, (t[until], weights[until]), (t[row], weights[row]))
        own, beside = np.split(both, [row.stop - row.start], axis=1)
        of_tails = np.concatenate([both[:, :0], *(part[:, :, row] for part in by_tail)], axis=1)
        of_next = beside - by_tails[row.stop : until.stop] @ of_tails
        out = np.hstack([by_tails[row], np.eye(row.stop - row.start, before)])
        into = np.concatenate([of_tails, of_next], axis=1)
        found.append(Block(row, own, into, out, np.pad(move, ((0, after), (0, before)))))
    return found


def _covariances(of_instants: Callable[[Array], Array], one: tuple[Array, Array], other: tuple[Array, Array]) -> Array:
    """Return the covariances of `one` set of rows with the `other`, then each ∂/∂ln θ_j; the shape is (1 + p, n, m).

    A row is a weighted sum of values of a process. A set is a pair: the times [s] and the weights of the terms of each
    row, both (n, J) or both (m, J). `of_instants` gives these covariances for instants r [s] apart, shape (1 + p,
    *r.shape).
    """
    (t, w), (s, v) = ((of[:, weights.any(axis=0)].T for of in (times, weights)) for times, weights in (one, other))
    total = np.zeros(())
    for time, weight in zip(t, w, strict=True):  # one call for all terms of the other set
        every = of_instants(time[:, None] - s[:, None])
        total = sum((weight[:, None] * of * every[:, k] for k, of in enumerate(v)), total)
    return total


class Factor(NamedTuple):
    """The Cholesky factor of S, the covariance of a block's samples given all earlier ones, and the `gain` X = S⁻¹ Bᵀ.

    B is the covariance of the state after the block with the block's samples, given all earlier ones. Xᵀ takes into the
    state the part of the block's samples that earlier samples do not explain.
    """

    cholesky: Array
    gain: Array

    def inverse(self) -> Array:
        """Return S⁻¹ (b, b), with the factorised covariance S of b samples given all earlier ones."""
        inverse, _ = scipy.linalg.lapack.dtrtri(self.cholesky, lower=True)
        return np.asarray(inverse.T @ inverse)


@dataclass(frozen=True)
class Quasiseparable(Factorisation):
    """A = L S Lᵀ with block diagonal S, L_ii = I, and L_ki = P_k Φ_{k−1} ⋯ Φ_{i+1} X_iᵀ for blocks k > i.

    `factors` have S_i and X_i (see `Factor`); `blocks` have P_i, the state's effect on samples, and Φ_i, its move.
    """

    blocks: list[Block]
    factors: list[Factor]
    noise_variance: Array

    @classmethod
    def of(cls, blocks: list[Block], noise_variance: Array) -> Self | None:
        """Factorise A, the covariance in these blocks plus noise, (n,); None if A is not positive definite."""
        factors = list[Factor]()
        explained = np.zeros((blocks[0].move.shape[1],) * 2)  # the state's covariance that earlier samples explain
        for block in blocks:
            seen = block.out @ explained
            left = block.own[0] - seen @ block.out.T
            left[np.diag_indices(len(left))] += noise_variance[block.rows]
            cholesky, info = scipy.linalg.lapack.dpotrf(left, lower=True)
            if info:
                return None
            moved = block.into[0] - block.move @ seen.T
            factor = Factor(cholesky, cholesky_solve(cholesky, moved.T))
            explained = moved @ factor.gain + block.move @ explained @ block.move.T
            factors.append(factor)
        return cls(blocks, factors, noise_variance)

    @cached_property
    def log_determinant(self) -> float:
        return 2 * float(sum(np.log(factor.cholesky.diagonal()).sum() for factor in self.factors))

    def solve(self, right: Array) -> Array:
        solution = np.array(right, dtype=float)
        state = np.zeros((self.blocks[0].move.shape[1], *right.shape[1:]))
        for block, factor in zip(self.blocks, self.factors, strict=True):
            solution[block.rows] -= block.out @ state
            state = factor.gain.T @ solution[block.rows] + block.move @ state
            solution[block.rows] = cholesky_solve(factor.cholesky, solution[block.rows])
        state = np.zeros((len(self.blocks[-1].move), *right.shape[1:]))
        for block, factor in self._backwards():
            solution[block.rows] -= factor.gain @ state
            state = block.out.T @ solution[block.rows] + block.move.T @ state
        return solution

    def gradient_times(self, c: Array) -> Array:
        return times(self.blocks, c)[1:]

    def likelihood_traces(self, c: Array) -> tuple[Array, float]:
        """Return tr((A⁻¹ − c cᵀ) ∂K/∂ln θ_j) and tr((A⁻¹ − c cᵀ) V), from the last block to the first.

        They need the blocks Z_ii of Z = A⁻¹, and Y_i = Σ_{k > i} (P_k Φ_{k−1} ⋯ Φ_{i+1})ᵀ Z_ki (P, Φ, S, X: see the
        class). With N_i = Σ_{k, l > i} (P_k Φ_{k−1} ⋯ Φ_{i+1})ᵀ Z_kl (P_l Φ_{l−1} ⋯ Φ_{i+1}) they are Y_i = −N_i X_iᵀ
        and Z_ii = S_i⁻¹ + X_i N_i X_iᵀ. N_{i−1} = P_iᵀ S_i⁻¹ P_i + Ψᵀ N_i Ψ with Ψ = Φ_i − X_iᵀ P_i: no digits cancel
        in this sum of positive semidefinite matrices.
        """
        by_kernel, by_noise = np.zeros(len(self.blocks[0].own) - 1), 0.0
        state = np.zeros(len(self.blocks[-1].move))
        known = np.diag(state)
        for block, factor in self._backwards():
            own, later, inverse = c[block.rows], -known @ factor.gain.T, factor.inverse()
            among = inverse - factor.gain @ later - own[:, None] * own
            by_kernel += np.einsum("pij,ij->p", block.own[1:], among)
            by_kernel += 2 * np.einsum("pri,ri->p", block.into[1:], later - state[:, None] * own)
            by_noise += float(among.diagonal() @ self.noise_variance[block.rows])
            passed = block.move - factor.gain.T @ block.out
            known = block.out.T @ inverse @ block.out + passed.T @ known @ passed
            state = block.out.T @ own + block.move.T @ state
        return by_kernel, by_noise

    def _backwards(self) -> Iterator[tuple[Block, Factor]]:
        return zip(reversed(self.blocks), reversed(self.factors), strict=True)


def times(blocks: list[Block], c: Array) -> Array:
    """Return K c and each ∂K/∂ln θ c of the covariance in these blocks, for c (n,); the shape is (1 + p, n)."""
    product = np.empty((len(blocks[0].own), len(c)))
    before = np.zeros((blocks[0].move.shape[1], len(product)))
    for block in blocks:
        product[:, block.rows] = block.own @ c[block.rows] + (block.out @ before).T
        before = (block.into @ c[block.rows]).T + block.move @ before
    after = np.zeros(len(blocks[-1].move))
    for block in reversed(blocks):
        product[:, block.rows] += after @ block.into
        after = block.out.T @ c[block.rows] + block.move.T @ after
    return product
