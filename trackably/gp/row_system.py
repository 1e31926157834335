"""Solve equations with the posterior covariance K⁺ of rows, in a time linear in the number of samples and rows.

A row is a linear functional L_a of a process g: a weighted sum of its values at a few times (`rows`). A row with noise
of variance D_a is like one more sample. So (K⁺ + D)⁻¹ is the block of the rows in the inverse of the covariance of
samples with noise V and rows with noise D. For Matérn kernels and sums of them, this covariance is quasiseparable, as
the times of a row are close together, and rows are sorted by their first times.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property as cached
from typing import Self

import numpy as np
import numpy.typing as npt

from trackably.arrays import Array, Flags
from trackably.gp.factorise import noise_variance, terms_of
from trackably.gp.factors.quasiseparable import Block, Quasiseparable, blocks, row_blocks, times
from trackably.gp.posterior import Posterior
from trackably.gp.rows import Terms

Places = npt.NDArray[np.intp]

_BLOCK = 48  # smallest number of samples and rows in a block
# Largest λ times the time between the first and last instant of a row. Covariances are extrapolated backwards by this
# time, over which e^(−λ|r|) grows by e⁵ at most.
_WITHIN_A_ROW = 5.0
_ABSENT = 1e18  # variance of the noise on a row that is not active, relative to its own variance


@dataclass(frozen=True)
class RowSystem:
    """The covariances of n samples and r rows (linear functionals) of a process in `blocks`, sorted by first times.

    `samples` (n,) and `rows` (r,) are the indices of samples and rows in this order. `part` is the posterior of the
    process.
    """

    part: Posterior
    blocks: list[Block]
    samples: Places
    rows: Places

    @classmethod
    def of(cls, part: Posterior, terms: Terms, count: int) -> Self | None:
        """Return the system of `count` rows (linear functionals), which are sums of these `terms`.

        Return None if the kernel is no sum of polynomials times e^(−λ|r|), or if it decays too fast within a row.
        """
        n, kernel, of_samples = len(part.samples), part.prior.kernel, terms_of(part.samples)
        every, count = Terms.joined([of_samples, terms.renumber(n + np.arange(count))]), n + count
        first = every.first_times(count)
        longest = float(np.max(every.times - first[every.of_row]))
        own = [decay.only(0) for decay in kernel.decays]
        if not own or max(tail.rate for tail in own) * longest > _WITHIN_A_ROW:
            return None
        order = np.argsort(first, kind="stable")
        places = np.empty(count, dtype=np.intp)
        places[order] = np.arange(count)
        cuts = blocks(first[order], longest, _BLOCK)
        found = row_blocks(every.renumber(places), cuts, own)
        return cls(part, found, places[:n], places[n:])

    @cached
    def variances(self) -> Array:
        """The prior variances of the rows (linear functionals), shape (r,)."""
        return np.concatenate([block.own[0].diagonal() for block in self.blocks])[self.rows]

    def cross(self, multipliers: Array) -> Array:
        """Return the covariance (n,) of Σ_a ν_a L_a g with each sample, for rows L_a g with `multipliers` ν (r,)."""
        return np.asarray(times(self.blocks, self._spread(multipliers))[0, self.samples])

    def product(self, multipliers: Array) -> Array:
        """Return K⁺ ν, the posterior covariance of the rows times the `multipliers` ν; the shape is (r,)."""
        both = self._spread(multipliers)
        both[self.samples] = -self.part.solve(times(self.blocks, both)[0, self.samples])
        return np.asarray(times(self.blocks, both)[0, self.rows])

    def solver(self, active: Flags, jitter: Array | float) -> Callable[[Array], tuple[Array, Array]] | None:
        """Return the function that solves (K⁺_AA + D) x = b for b (m,), with the covariance K⁺_AA of m `active` rows.

        It returns x (m,) and the products K⁺ x for all rows (r,). D has `jitter` times the prior variances of these
        rows on its diagonal. All other rows get noise so large that they do not count. Return None if the covariance of
        samples and rows with noise is not positive definite in float64.
        """
        variances = self._spread(np.where(active, jitter, _ABSENT) * self.variances)
        variances[self.samples] = noise_variance(self.part.prior, self.part.samples)
        if (factor := Quasiseparable.of(self.blocks, variances)) is None:
            return None
        rows = self.rows[active]

        def solve(b: Array) -> tuple[Array, Array]:
            right = np.zeros(len(variances))
            right[rows] = b
            found = factor.solve(right)
            return found[rows], (right - variances * found)[self.rows]

        return solve

    def _spread(self, of_rows: Array) -> Array:
        both = np.zeros(len(self.samples) + len(self.rows))
        both[self.rows] = of_rows
        return both
