"""Rows: finitely many linear functionals of the processes, each a weighted sum of values at shifted times."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property as cached
from math import factorial
from typing import NamedTuple, Self

import numpy as np
import numpy.typing as npt
from numpy.lib.stride_tricks import sliding_window_view

from trackably.arrays import Array
from trackably.gp.kernels.base import Kernel, MomentSum
from trackably.gp.signal import in_blocks


class Terms(NamedTuple):
    """Terms of rows (linear functionals) in one process g: row `of_row[p]` has the term `weights[p]` g(`times[p]`).

    All arrays have the shape (P,). Rows are numbered from zero, times are in seconds.
    """

    times: Array
    weights: Array
    of_row: npt.NDArray[np.intp]

    @classmethod
    def joined(cls, parts: Sequence["Terms"]) -> Self:
        """Return the terms of all parts; equal numbers of rows in several parts mean the same row."""
        none = np.empty(0), np.empty(0), np.empty(0, dtype=np.intp)
        return cls(*map(np.concatenate, zip(none, *parts, strict=True)))

    def renumber(self, places: npt.NDArray[np.intp]) -> Self:
        """Return the terms with row a renumbered as `places`[a]; rows with a negative place are dropped."""
        kept = places[self.of_row] >= 0
        return type(self)(self.times[kept], self.weights[kept], places[self.of_row[kept]])

    def spread(self, multipliers: Array) -> Array:
        """Return Σ_a ν_a L_a as weights at the `times`, shape (P,), from one multiplier ν_a for each row."""
        return np.asarray(self.weights * multipliers[self.of_row])

    def summed(self, values: Array, count: int) -> Array:
        """Return L_a v for each of `count` rows, from values v (P, …) at the `times`; the shape is (count, …)."""
        values = np.asarray(values, dtype=float)
        total = np.zeros((count, *values.shape[1:]))
        np.add.at(total, self.of_row, (self.weights * values.T).T)
        return total

    def by_row(self, count: int) -> tuple[Array, Array]:
        """Return times [s] and weights of the terms of each of `count` rows, shapes (count, J) for the longest row.

        Shorter rows are filled up with zero weights at their first times.
        """
        order = np.argsort(self.of_row, kind="stable")
        rows = self.of_row[order]
        turn = np.arange(len(rows)) - np.searchsorted(rows, rows)  # 0 for the first term of each row, 1 for the second
        times = np.repeat(self.first_times(count)[:, None], np.max(turn, initial=-1) + 1, axis=1)
        weights = np.zeros(times.shape)
        times[rows, turn], weights[rows, turn] = self.times[order], self.weights[order]
        return times, weights

    def first_times(self, count: int) -> Array:
        """Return the earliest time [s] of each row's terms, shape (count,); zero for rows without terms."""
        first = np.full(count, np.inf)
        np.minimum.at(first, self.of_row, self.times)
        return np.where(np.isfinite(first), first, 0.0)


@dataclass(frozen=True)
class Rows:
    """Rows q_a = `offsets`[a] + Σ_c L_a g_c, a = 0 … n − 1: `terms[c]` has the terms of all L_a in the process g_c."""

    offsets: Array
    terms: tuple[Terms, ...]

    def __len__(self) -> int:
        return len(self.offsets)

    def among(self, chosen: npt.NDArray[np.intp]) -> Self:
        """Return the rows with the increasing indices `chosen` (m,), renumbered from zero."""
        places = np.full(len(self), -1)
        places[chosen] = np.arange(len(chosen))
        return type(self)(self.offsets[chosen], tuple(terms.renumber(places) for terms in self.terms))

    def values(self, signals: Sequence[Callable[[Array], Array]]) -> Array:
        """Return the values q_a of the rows, shape (n,), for given signals, one for each process."""
        parts = (terms.summed(g(terms.times), len(self)) for g, terms in zip(signals, self.terms, strict=True))
        return np.asarray(sum(parts, self.offsets))


# Covariances of rows, and how they move with the hyperparameters. A row is a sum of derivatives at single times:
#
#     L g = Σ_p Σ_n μ_pn g⁽ⁿ⁾(t_p),        L L' κ = Σ_pq Σ_nm μ_pn μ'_qm (−1)ᵐ κ⁽ⁿ⁺ᵐ⁾(t_p − t'_q).
#
# Its terms are such a sum: values (n = 0), with their weights. But a row such as (g(t + 2h) − 2 g(t + h) + g(t))/h² is
# small compared with its terms. Sums over terms multiply rounding errors of κ by 1/h⁴: for h = 0.01 s they have no
# correct digit. Taylor's series about the row's first time t_0 has no such differences: it is one part, with
# μ_n = Σ_p w_p (t_p − t_0)ⁿ/n!.

_EPS = float(np.finfo(float).eps)
_LARGEST_ERROR = 1e-12  # relative to a row's variance: with larger rounding errors, sums over terms are not used
# Relative to a row's standard deviation: the series ends where all further terms are smaller. All covariances then
# belong to the same functionals, so that their matrix is positive semidefinite. With a smaller number, more series
# would be too long, and sums over terms, taken instead, would give references enormous weights.
_NEGLIGIBLE = 1e-11
_LONGEST = 14  # terms of the longest series
_FACTORIALS = np.array([float(factorial(n)) for n in range(_LONGEST)])
_SIGNS = (-1.0) ** np.arange(_LONGEST)
_MANY = 2**18  # terms: for fewer, moments take longer than the sum
_NODES, _APART = 9, 0.1  # nodes for a row, and their distance in correlation times; errors are about 0.4⁹/√9!


def row_kernel(kernel: Kernel, terms: Terms, count: int) -> "RowKernel":
    """Return covariances of rows (linear functionals), as sums over their terms.

    If these sums have too large rounding errors, Taylor series take their place.
    """
    direct = RowKernel(kernel, terms.times, terms.weights[:, None], terms.of_row, count)
    if not (kernel.is_analytic and len(terms.times)):
        return direct
    first = terms.first_times(count)
    after = terms.times - first[terms.of_row]
    moments = terms.summed(after[:, None] ** np.arange(_LONGEST) / _FACTORIALS, count)
    sizes = np.abs(moments) * _deviations(kernel, _LONGEST)
    row = np.max(sizes, axis=1)
    if np.all(direct.rounding <= _LARGEST_ERROR * row**2):
        return direct
    needed = np.flatnonzero(np.any(sizes > _NEGLIGIBLE * row[:, None], axis=0))
    if needed[-1] == _LONGEST - 1:  # the series does not end: a row lasts too long, in correlation times
        return direct
    return RowKernel(kernel, first, moments[:, : needed[-1] + 1], np.arange(count), count)


def _deviations(kernel: Kernel, count: int) -> Array:
    """Return the prior's standard deviations of g, g⁽¹⁾, …, shape (count,)."""
    return np.asarray(np.sqrt(np.abs(kernel.jet(np.zeros(()), 2 * count - 2)[::2])))


@dataclass(frozen=True)
class RowKernel:
    """Covariances of `count` rows (linear functionals) of a process with each other, and with the process at any time.

    Row `of_row`[p] has the part Σ_n `moments`[p, n] g⁽ⁿ⁾(`times`[p]); the shapes are (P,), (P, N) and (P,), times in
    seconds. N is 1 for sums over terms.
    """

    kernel: Kernel
    times: Array
    moments: Array
    of_row: npt.NDArray[np.intp]
    count: int

    @cached
    def centres(self) -> Terms:
        """The times t_p and weights w_p of the kernels in κ(·, L_a) = Σ_p w_p κ(· − t_p), for each row L_a.

        A series is replaced by terms with the 9 lowest moments, but at times further apart than the row's own, so that
        weights stay small. With a step h = 0.01 s, the weights 1/h² of a second difference would dominate all rounding
        errors of the reference. Here, times lie k H after a row's first time, for k = −4 … 4 and H of a tenth of the
        correlation time. Their weights w_k satisfy Σ_k w_k (k H)ⁿ/n! = μ_n, with the moments μ_n, for n = 0 … 8.
        """
        if not self._order:
            return Terms(self.times, self.moments[:, 0], self.of_row)
        powers = np.arange(_NODES)
        nodes = (powers - _NODES // 2) * (_APART * self.kernel.correlation_time)
        scale = nodes[-1] ** -powers
        vandermonde = scale[:, None] * (nodes ** powers[:, None] / _FACTORIALS[:_NODES, None])
        moments = np.zeros((self.count, _NODES))
        known = self.moments[:, :_NODES]
        moments[:, : known.shape[1]] = known
        weights = np.linalg.solve(vandermonde, (scale * moments).T).T
        times = self.times[:, None] + nodes
        return Terms(times.ravel(), weights.ravel(), np.repeat(self.of_row, _NODES))

    @property
    def rounding(self) -> Array:
        """The rounding errors of the rows' variances, shape (count,): about ε (Σ_pn |μ_pn| √(±κ⁽²ⁿ⁾(0)))²."""
        return np.asarray(_EPS * self._by_row(np.abs(self.moments) @ _deviations(self.kernel, self._order + 1)) ** 2)

    def among(self) -> Array:
        """Return the prior covariances L_a L_b κ of the rows; the shape is (count, count)."""
        seen = in_blocks(self._derivatives, self.times, len(self.times) * (self._order + 1))
        return self._sum(np.swapaxes(seen, 1, 2))

    def across(self, t: Array) -> Array:
        """Return the covariances L_a κ(·, t) of the rows with values at times t [s], (n,); the shape is (count, n)."""
        return in_blocks(lambda t: self._sum(self.kernel.jet(self.times[:, None] - t, self._order)), t, len(self.times))

    def energy_gradient(self, multipliers: Array, t: Array, weights: Array) -> Array:
        """Return ∂/∂ln θ_j of 2 νᵀ (L κ(·, t)) w + νᵀ (L L κ) ν, for all hyperparameters of the kernel.

        ν are the `multipliers` (count,) of the rows' functionals L, and w the `weights` at times t [s], both of shape
        (n,). Long sums use moments if the kernel is a sum of decays, for which no row is a series.
        """
        times, u = self._weigh(multipliers)
        every = np.concatenate([t, times])
        if len(times) * len(every) > _MANY and (decays := self.kernel.decays):
            both = np.concatenate([2 * weights, u[:, 0]])
            return np.asarray(MomentSum(decays, every, both).gradient(times) @ u[:, 0])
        return 2 * self._form_gradient(times, u, t, weights[:, None]) + self._form_gradient(times, u, times, u)

    def _derivatives(self, t: Array) -> Array:
        """Return the covariances of the rows with g⁽ⁿ⁾(t), for n < N, at times t [s] (T,): (N, count, T)."""
        jet = self.kernel.jet(self.times[:, None] - t, 2 * self._order)
        by_sum = sliding_window_view(jet, self._order + 1, axis=0)  # [n, p, i, m]: κ⁽ⁿ⁺ᵐ⁾ of part p and time i
        each = np.einsum("npim,pm->npi", by_sum, self.moments)
        return np.array([sign * self._by_row(of) for sign, of in zip(_SIGNS, each, strict=False)])

    def _sum(self, jet: Array) -> Array:
        """Return Σ_pn μ_pn v_pn for each row, from values v_pn: (N, P, …); the shape is (count, …)."""
        return self._by_row(np.einsum("pn,npi->pi", self.moments, jet))

    def _by_row(self, values: Array) -> Array:
        """Return for each row the sum of the `values` (P, …) of its parts; the shape is (count, …)."""
        total = np.zeros((self.count, *values.shape[1:]))
        np.add.at(total, self.of_row, values)
        return total

    def _form_gradient(self, times: Array, u: Array, t: Array, weights: Array) -> Array:
        """Return ∂/∂ln θ of Σ_pi Σ_nm u_pn w_im (−1)ᵐ κ⁽ⁿ⁺ᵐ⁾(times_p − t_i)."""
        count, pairs = u.shape[1], zip(_SIGNS, weights.T, strict=False)
        _, by_theta = self.kernel.jet_and_gradient(times[:, None] - t, count + weights.shape[1] - 2)
        seen = sum(sign * (by_theta[:, m : m + count] @ w) for m, (sign, w) in enumerate(pairs))
        return np.asarray(np.einsum("pna,an->p", seen, u) if self._order else seen[:, 0] @ u[:, 0])

    def _weigh(self, multipliers: Array) -> tuple[Array, Array]:
        """Return the times [s] of the parts with nonzero multipliers, and their moments times the multipliers."""
        u = self.moments * multipliers[self.of_row, None]
        some = np.any(u != 0, axis=1)
        return self.times[some], u[some]

    @property
    def _order(self) -> int:
        return int(self.moments.shape[1]) - 1
