"""Redundant inputs: which pushes an input set attains at all, and the smallest admissible input for each.

Inputs u and u + Z v push a linear system alike, whatever v is, where the columns of Z span the kernel of B. So what has
to hold for u is that there is a v with lower ≤ R (u + Z v) ≤ upper. That is so if and only if

    Σ_(λ_i > 0) λ_i lower_i + Σ_(λ_i < 0) λ_i upper_i  ≤  λᵀ R u  ≤  Σ_(λ_i > 0) λ_i upper_i + Σ_(λ_i < 0) λ_i lower_i

for every circuit λ of the rows of R Z: a λ with λᵀ R Z = 0 that has no other such support within its own. They are
finitely many, up to a factor. (One direction is plain; the other is Farkas' lemma, as every λ with λᵀ R Z = 0 is a sum
of circuits in which no sign meets its opposite.)
"""

import math
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import combinations, product
from typing import NamedTuple

import numpy as np
from flint import fmpq_mat

from trackable.arrays import Array
from trackable.systems.flat.rationals import beside, exact, fraction, kernel, rounded, row_of, stacked
from trackable.systems.linear import LinearSystem
from trackable.systems.sets.interval import Interval
from trackable.systems.sets.polytope import Polytope

_MOST = 10_000
_AT_ONCE = 2**22
_ROUNDING = 2.0**-48  # of the sum of what is added up


class Attainable(NamedTuple):
    """`bounds` of Σ_i `row`[i] u_i, which are the same for all inputs that push alike."""

    row: tuple[Fraction, ...]
    bounds: Interval


@dataclass(frozen=True, eq=False)
class Allocation:
    """Inputs of an `input_set` {u : lower ≤ R u ≤ upper} that push alike if they differ by columns of `kernel` Z."""

    input_set: Polytope
    kernel: tuple[fmpq_mat, ...]

    @classmethod
    def of(cls, system: LinearSystem, input_set: Polytope) -> "Allocation | None":
        """None where no two inputs push alike, or none is bounded. ValueError for too many rows to combine."""
        free = kernel(exact(system.B))
        if not free or not len(input_set.rows):
            return None
        sizes = range(1, len(free) + 2)
        if sum(math.comb(len(input_set.rows), size) * 2**size for size in sizes) > _MOST:
            raise ValueError(
                f"system: {len(free)} redundant inputs are too many for an input set of {len(input_set.rows)} rows"
            )
        return cls(input_set, tuple(free))

    @property
    def attainable(self) -> list[Attainable]:
        """What u has to keep so that some admissible input pushes as u does: all of it, and nothing else."""
        rows = [_fractions(row) for row in self.input_set.rows]
        lower, upper = _fractions(self.input_set.lower), _fractions(self.input_set.upper)
        found: dict[tuple[Fraction, ...], tuple[Fraction, Fraction]] = {}
        for circuit in self._circuits():
            row = [sum((factor * rows[i][j] for i, factor in circuit), Fraction(0)) for j in range(len(rows[0]))]
            scale = max(row, key=abs) or Fraction(1)
            factors = [(i, factor / scale) for i, factor in circuit]
            low = sum((factor * (lower if factor > 0 else upper)[i] for i, factor in factors), Fraction(0))
            high = sum((factor * (upper if factor > 0 else lower)[i] for i, factor in factors), Fraction(0))
            direction = tuple(r / scale for r in row)
            lowest, highest = found.get(direction, (low, high))
            found[direction] = max(low, lowest), min(high, highest)
            self._refuse_empty(direction, *found[direction])
        return [
            Attainable(row, Interval(_float_above(low), -_float_above(-high)))
            for row, (low, high) in found.items()
            if any(row)
        ]

    def _refuse_empty(self, row: tuple[Fraction, ...], low: Fraction, high: Fraction) -> None:
        """Without any u in it an inequality says whether U holds an input at all; with one, whether it can be kept."""
        if not (low < high if any(row) else low <= 0 <= high):
            raise ValueError(f"set: must have an interior, but no input lies strictly inside {self.input_set}")

    def smallest(self, u: Array) -> Array:
        """The smallest admissible input (Euclidean) that pushes as u (…, m) does, u having no part along Z.

        Where none is admissible, that one of the laws' (`_laws`) which leaves the set least.
        """
        chosen = self._choice(u)
        gains, shifts = self._laws
        return np.asarray(np.einsum("...ij,...j->...i", gains[chosen], u) + shifts[chosen])

    def slopes(self, u: Array) -> Array:
        """∂/∂u of the smallest admissible input at u (…, m): shape (…, m, m)."""
        return np.asarray(self._laws[0][self._choice(u)])

    def _choice(self, u: Array) -> Array:
        """Which of the laws gives the smallest admissible input, of u (…, m): shape (…,)."""
        flat = u.reshape(-1, u.shape[-1])
        blocks = np.array_split(flat, 1 + flat.size * len(self._laws[1]) // _AT_ONCE)
        return np.concatenate([self._choice_of(block) for block in blocks]).reshape(u.shape[:-1])

    def _choice_of(self, u: Array) -> Array:
        choice = np.zeros(len(u), dtype=int)  # the first law is u itself
        outside = self.input_set.margin(u) < 0
        u = u[outside]
        gains, shifts = self._laws
        candidates = np.einsum("cij,kj->cki", gains, u) + shifts[:, None]
        sides = self.input_set
        values, widths = candidates @ sides.rows.T, sides.upper - sides.lower
        summed = np.einsum("cij,kj->cki", np.abs(gains), np.abs(u)) + np.abs(shifts)[:, None]
        excess = np.maximum(values - sides.upper, sides.lower - values) - _ROUNDING * (summed @ np.abs(sides.rows).T)
        beyond = np.max(np.maximum(excess, 0) / widths, axis=-1)
        norms = np.where(beyond <= np.min(beyond, axis=0), np.linalg.norm(candidates, axis=-1), np.inf)
        choice[outside] = np.argmin(norms, axis=0)
        return choice

    @cached_property
    def _laws(self) -> tuple[Array, Array]:
        """Gains (c, m, m) and shifts (c, m): the admissible input nearest to zero is one of gain u + shift.

        It is the point nearest to zero of those that hit some bounds b_S, whatever the others: u + Z v with

            v = G⁻¹ P_Sᵀ (P_S G⁻¹ P_Sᵀ)⁻¹ (b_S − R_S u),     G = Zᵀ Z,   P = R Z,

        for some rows S whose P_S are independent. All of that is exact, and rounded once.
        """
        Z, R, m = beside(list(self.kernel)), exact(self.input_set.rows), self.input_set.dimension
        inverse = (Z.transpose() * Z).inv()
        ends = self.input_set.lower, self.input_set.upper
        gains, shifts = [np.eye(m)], [np.zeros(m)]
        for size in range(1, len(self.kernel) + 1):
            for hit in combinations(range(len(self.input_set.rows)), size):
                rows = stacked([row_of(R, i) for i in hit])
                P = rows * Z
                if P.rank() == size:
                    back = Z * inverse * P.transpose() * (P * inverse * P.transpose()).inv()
                    gain = np.eye(m) - rounded(back * rows)
                    for sides in product(ends, repeat=size):
                        bounds = exact(np.array([[side[i]] for side, i in zip(sides, hit, strict=True)]))
                        gains.append(gain)
                        shifts.append(rounded(back * bounds)[:, 0])
        return np.array(gains), np.array(shifts)

    def _circuits(self) -> Iterator[list[tuple[int, Fraction]]]:
        """Rows of the input set, each with its factor: whatever some rows have as their only relation."""
        rows = exact(self.input_set.rows)
        pushes = [[(row_of(rows, i) * column)[0, 0] for column in self.kernel] for i in range(rows.nrows())]
        for size in range(1, len(self.kernel) + 2):
            for support in combinations(range(rows.nrows()), size):
                flat = [p for along in zip(*(pushes[i] for i in support), strict=True) for p in along]
                relations = kernel(fmpq_mat(len(self.kernel), size, flat))
                if len(relations) == 1:
                    yield [(i, fraction(relations[0][k, 0])) for k, i in enumerate(support)]


def _fractions(numbers: Array) -> list[Fraction]:
    return [Fraction(v) for v in numbers.tolist()]


def _float_above(number: Fraction) -> float:
    """The smallest float64 that is no smaller, if there is one; no number of float64's range lies below the lowest."""
    try:
        nearest = float(number)
    except OverflowError:
        return math.inf if number > 0 else -sys.float_info.max
    return nearest if Fraction(nearest) >= number else math.nextafter(nearest, math.inf)
