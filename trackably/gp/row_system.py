"""Samples and rows together: equations with the posterior covariance of rows, in time linear in their number.

A row with noise of variance D_a is one more sample. So (K⁺ + D)⁻¹ is the block of the rows in the inverse of the
covariance of samples with noise V and rows with noise D. For Matérn kernels and sums of them, this matrix is
quasiseparable: a row is a sum of values within a few steps, and rows are sorted by their first time.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Self

import numpy as np
import numpy.typing as npt

from trackably.arrays import Array
from trackably.cached import cached
from trackably.gp.factorise import noise_variance
from trackably.gp.factors.quasiseparable import Block, Quasiseparable, blocks, tails, times
from trackably.gp.kernels.base import Kernel
from trackably.gp.posterior import Posterior
from trackably.gp.rows import Terms

Places = npt.NDArray[np.intp]

_BLOCK = 48  # rows
_WITHIN_A_ROW = 5.0  # as λ times the time between the terms of a row: numbers grow by e⁵ within it


@dataclass(frozen=True)
class RowSystem:
    """The covariances of n samples and r rows in `blocks`, with the places of `samples` and `rows` among all."""

    part: Posterior
    blocks: list[Block]
    samples: Places
    rows: Places

    @classmethod
    def of(cls, part: Posterior, terms: Terms, count: int) -> Self | None:
        """Return the system of `count` rows with these terms; None unless the kernel is a sum of decays."""
        n, stencil = len(part.samples), part.samples.stencil
        seen = part.samples.centres
        of_samples = Terms(seen, stencil.spread(np.ones(n)), np.tile(np.arange(n), len(seen) // n))
        found = _blocks(part.prior.kernel, Terms.joined([of_samples, terms], [0, n]), n + count)
        if found is None:
            return None
        cut, places = found
        return cls(part, cut, places[:n], places[n:])

    @cached
    def variances(self) -> Array:
        """The variances of the rows before any sample, shape (r,)."""
        return np.concatenate([block.own[0].diagonal() for block in self.blocks])[self.rows]

    def seen(self, multipliers: Array) -> Array:
        """Return (L κ(·, S))ᵀ ν, the covariance of Σ_a ν_a L_a g with each sample: shape (n,)."""
        return np.asarray(times(self.blocks, self._spread(multipliers))[0, self.samples])

    def product(self, multipliers: Array) -> Array:
        """Return K⁺ ν: shape (r,)."""
        both = self._spread(multipliers)
        both[self.samples] = -self.part.solve(times(self.blocks, both)[0, self.samples])
        return np.asarray(times(self.blocks, both)[0, self.rows])

    def solver(self, noise: Array) -> Callable[[Array], Array] | None:
        """Return the function that solves (K⁺ + D) x = b for D of the rows' `noise` variances (r,).

        None if it is not positive definite in float64.
        """
        variances = self._spread(noise)
        variances[self.samples] = noise_variance(self.part.prior, self.part.samples)
        factor = Quasiseparable.of_blocks(self.blocks, variances)
        return None if factor is None else lambda b: np.asarray(factor.solve(self._spread(b))[self.rows])

    def _spread(self, of_rows: Array) -> Array:
        both = np.zeros(len(self.samples) + len(self.rows))
        both[self.rows] = of_rows
        return both


def _blocks(kernel: Kernel, terms: Terms, count: int) -> tuple[list[Block], Places] | None:
    """Return the covariances of `count` rows in blocks, and the place of each row among all of them."""
    own = tails(kernel, [(1.0, 0.0)])
    first, last = terms.first_times(count), -Terms(-terms.times, terms.weights, terms.of_row).first_times(count)
    longest = float(np.max(last - first))
    if not own or max(tail.rate for tail in own) * longest > _WITHIN_A_ROW:
        return None
    order = np.argsort(first, kind="stable")
    places = np.empty(count, dtype=np.intp)
    places[order] = np.arange(count)
    by_row = np.argsort(places[terms.of_row], kind="stable")
    t, weights, of_row = terms.times[by_row], terms.weights[by_row], places[terms.of_row[by_row]]
    rows = blocks(first[order], longest, _BLOCK)
    starts = [row.start for row in rows]
    begins, at = first[order[starts]], np.searchsorted(of_row, [*starts, count])
    ends, of_block = np.append(begins[1:], np.max(last)), np.repeat(np.arange(len(rows)), np.diff(at))
    moves = np.zeros((len(rows), *[sum(tail.size for tail in own)] * 2))
    seen, into = np.zeros((count, moves.shape[1])), np.zeros((moves.shape[1], count))
    j = 0
    for tail in own:
        size = slice(j, j := j + tail.size)
        moves[:, size, size] = tail.moved(ends - begins)
        seen[:, size] = _summed(of_row, weights[:, None] * tail.values(t - begins[of_block]), count)
        into[size] = _summed(of_row, (weights * tail.of_samples(ends[of_block] - t)[0]).T, count).T
    found = []
    for i, row in enumerate(rows):
        stop = rows[i + 1].stop if longest and i + 1 < len(rows) else row.stop
        near = slice(at[i], np.searchsorted(of_row, stop))
        within = slice(at[i], at[i + 1])
        each = weights[near, None] * kernel(t[near, None] - t[within]) * weights[within]
        of_near = _summed(of_row[near] - row.start, each, stop - row.start)
        covariances = _summed(of_row[within] - row.start, of_near.T, row.stop - row.start).T
        size_of = row.stop - row.start
        told = into[:, row]
        if longest:
            told = np.concatenate([told, covariances[size_of:] - seen[row.stop : stop] @ told])
        found.append(Block(row, covariances[None, :size_of], told[None], seen[row], moves[i], longest > 0 and i > 0))
    return found, places


def _summed(of_row: Places, values: Array, count: int) -> Array:
    """Return the sums of values (P, m) over the terms of each row, whose numbers do not decrease: shape (count, m)."""
    if len(of_row) == count:
        return values
    return np.asarray(np.add.reduceat(values, np.searchsorted(of_row, np.arange(count)), axis=0))
