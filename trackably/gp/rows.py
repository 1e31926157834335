"""Rows: finitely many linear functionals of the processes, each a weighted sum of values at shifted times."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
import numpy.typing as npt

from trackably.arrays import Array
from trackably.gp.factors.cached import cached


@dataclass(frozen=True)
class Terms:
    """The terms of some rows that concern one process g: row `of_row[p]` has the term `weights[p]` g(`times[p]`).

    All arrays have the shape (P,). Rows count from zero, times are in seconds.
    """

    times: Array
    weights: Array
    of_row: npt.NDArray[np.intp]

    @classmethod
    def joined(cls, parts: Sequence["Terms"], starts: Sequence[int] | None = None) -> Self:
        """Return the terms of all parts; the rows of part i count from `starts[i]` on, or all from zero."""
        shifts = [0] * len(parts) if starts is None else starts
        rows = [part.of_row + start for part, start in zip(parts, shifts, strict=True)]
        return cls(
            np.concatenate([np.empty(0), *(part.times for part in parts)]),
            np.concatenate([np.empty(0), *(part.weights for part in parts)]),
            np.concatenate([np.empty(0, dtype=np.intp), *rows]),
        )

    def renumbered(self, places: npt.NDArray[np.intp]) -> Self:
        """Return the terms of rows a with `places`[a] ≥ 0, as those of rows `places`[a]."""
        kept = places[self.of_row] >= 0
        return type(self)(self.times[kept], self.weights[kept], places[self.of_row[kept]])

    def spread(self, multipliers: Array) -> Array:
        """Return Σ_a ν_a L_a as weights at the `times`, shape (P,), from one multiplier ν_a for each row."""
        return np.asarray(self.weights * multipliers[self.of_row])

    def summed(self, values: Array, count: int) -> Array:
        """Return L_a v for each of `count` rows, from values v (P, …) at the `times`: shape (count, …)."""
        values = np.asarray(values, dtype=float)
        if values.ndim == 1:
            return np.bincount(self.of_row, self.weights * values, count).astype(float)
        total = np.zeros((count, *values.shape[1:]))
        for terms in self._turns:
            weights = self.weights[terms].reshape(-1, *[1] * (values.ndim - 1))
            total[self.of_row[terms]] += weights * values[terms]
        return total

    @cached
    def _turns(self) -> tuple[npt.NDArray[np.intp], ...]:
        """The indices of the first term of each row, of the second, and so on: rows have few, and there are many."""
        order = np.argsort(self.of_row, kind="stable")
        rows = self.of_row[order]
        turn = np.arange(len(rows)) - np.searchsorted(rows, rows)
        return tuple(order[turn == k] for k in range(int(np.max(turn, initial=-1)) + 1))

    def first_times(self, count: int) -> Array:
        """Return the earliest time [s] of each row, shape (count,); zero for rows without terms."""
        first = np.full(count, np.inf)
        np.minimum.at(first, self.of_row, self.times)
        return np.where(np.isfinite(first), first, 0.0)

    def absolute(self, count: int) -> Array:
        """Return Σ_p |w_p| of each row, shape (count,)."""
        return np.bincount(self.of_row, np.abs(self.weights), count).astype(float)


@dataclass(frozen=True)
class Rows:
    """q_a = `offsets`[a] + Σ_c L_a g_c for a = 0 … n − 1: shape (n,), with the terms of process c in `terms[c]`."""

    offsets: Array
    terms: tuple[Terms, ...]

    @classmethod
    def joined(cls, parts: Sequence["Rows"], processes: int) -> Self:
        """Return the rows of all parts, below each other; every part has terms for each of the `processes`."""
        starts = np.cumsum([0, *map(len, parts)]).tolist()[:-1]
        return cls(
            np.concatenate([np.empty(0), *(part.offsets for part in parts)]),
            tuple(Terms.joined([part.terms[c] for part in parts], starts) for c in range(processes)),
        )

    def __len__(self) -> int:
        return len(self.offsets)

    def among(self, chosen: npt.NDArray[np.intp]) -> Self:
        """Return the chosen rows, by their increasing indices (m,), counted anew from zero."""
        places = np.full(len(self), -1)
        places[chosen] = np.arange(len(chosen))
        return type(self)(self.offsets[chosen], tuple(terms.renumbered(places) for terms in self.terms))

    def values(self, signals: Sequence[Callable[[Array], Array]]) -> Array:
        """Return all q_a of some signals, shape (n,)."""
        parts = (terms.summed(g(terms.times), len(self)) for g, terms in zip(signals, self.terms, strict=True))
        return np.asarray(sum(parts, self.offsets))
