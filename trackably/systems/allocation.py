"""Control allocation: which effects redundant inputs can attain in the input set, and the smallest input for each.

If the columns of Z span the null space of B, then u and u + Z v have the same effect on a linear system for every v.
The effect of u is attainable if a v with lower ≤ R (u + Z v) ≤ upper exists. That is so if and only if

    Σ_(λ_i > 0) λ_i lower_i + Σ_(λ_i < 0) λ_i upper_i  ≤  λᵀ R u  ≤  Σ_(λ_i > 0) λ_i upper_i + Σ_(λ_i < 0) λ_i lower_i

for every circuit λ of the rows of R Z: a λ ≠ 0 with λᵀ R Z = 0 of minimal support. Up to a factor there are finitely
many. (Necessity is obvious. Sufficiency is Farkas' lemma, as every λ with λᵀ R Z = 0 is a sum of circuits that agree
with it in sign.)
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

from trackably.arrays import Array
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Interval, Polytope
from trackably.systems.rationals import Matrix, beside

_MAX_LAWS = 10_000
_AT_ONCE = 2**22  # numbers in memory
ROUNDING = 2.0**-48
"""By how much a candidate may break a bound, relative to the sum of its absolute terms."""


class Attainable(NamedTuple):
    """The `bounds` of Σ_i `row`[i] u_i, a sum that is the same for all inputs of the same effect."""

    row: tuple[Fraction, ...]
    bounds: Interval


class Laws(NamedTuple):
    """Candidates for the smallest input: `gains`[c] u + `shifts`[c], shapes (c, m, m) and (c, m)."""

    gains: Array
    shifts: Array


@dataclass(frozen=True, eq=False)
class Allocation:
    """Redundant inputs of an `input_set` {u : lower ≤ R u ≤ upper}; the columns Z of `kernel` span the kernel of B."""

    input_set: Polytope
    kernel: tuple[Matrix, ...]

    @classmethod
    def of(cls, system: LinearSystem, input_set: Polytope) -> "Allocation | None":
        """Return the allocation; None without redundant inputs or bounds. ValueError: too many rows to combine."""
        free = Matrix.exact(system.B).null_space
        if not free or not len(input_set.rows):
            return None
        sizes = range(1, len(free) + 2)
        if sum(math.comb(len(input_set.rows), size) * 2**size for size in sizes) > _MAX_LAWS:
            raise ValueError(
                f"system: {len(free)} redundant inputs are too many for an input set of {len(input_set.rows)} rows"
            )
        return cls(input_set, tuple(free))

    @property
    def attainable(self) -> list[Attainable]:
        """The constraints on u that hold if and only if some admissible input has the effect of u."""
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
        """Raise ValueError if the bounds leave no interior: of a row of zeros, if U contains no input at all."""
        if not (low < high if any(row) else low <= 0 <= high):
            raise ValueError(f"set: must have an interior, but no input lies strictly inside {self.input_set}")

    def smallest(self, u: Array) -> Array:
        """Return the smallest admissible input (Euclidean) with the effect of u (…, m), where u is orthogonal to Z.

        If none is admissible, return the candidate of `laws` that violates the set least.
        """
        chosen = self._choice(u)
        gains, shifts = self.laws
        return np.asarray(np.einsum("...ij,...j->...i", gains[chosen], u) + shifts[chosen])

    def slopes(self, u: Array) -> Array:
        """Return ∂/∂u of the smallest admissible input at u (…, m): shape (…, m, m)."""
        return np.asarray(self.laws[0][self._choice(u)])

    def _choice(self, u: Array) -> Array:
        """Return which of the laws gives the smallest admissible input for u (…, m): shape (…,)."""
        flat = u.reshape(-1, u.shape[-1])
        blocks = np.array_split(flat, 1 + flat.size * len(self.laws[1]) // _AT_ONCE)
        return np.concatenate([self._choice_of(block) for block in blocks]).reshape(u.shape[:-1])

    def _choice_of(self, u: Array) -> Array:
        choice = np.zeros(len(u), dtype=int)  # the first law is u itself
        outside = self.input_set.margin(u) < 0
        u = u[outside]
        gains, shifts = self.laws
        candidates = np.einsum("cij,kj->cki", gains, u) + shifts[:, None]
        sides = self.input_set
        values, widths = candidates @ sides.rows.T, sides.widths
        summed = np.einsum("cij,kj->cki", np.abs(gains), np.abs(u)) + np.abs(shifts)[:, None]
        excess = np.maximum(values - sides.upper, sides.lower - values) - ROUNDING * (summed @ np.abs(sides.rows).T)
        beyond = np.max(np.maximum(excess, 0) / widths, axis=-1)
        norms = np.where(beyond <= np.min(beyond, axis=0), np.linalg.norm(candidates, axis=-1), np.inf)
        choice[outside] = np.argmin(norms, axis=0)
        return choice

    @cached_property
    def laws(self) -> Laws:
        """Inputs of which the smallest admissible one is among; the first of them is u itself.

        Each is the smallest input at which the bounds b_S of some rows S are active: u + Z v with

            v = G⁻¹ P_Sᵀ (P_S G⁻¹ P_Sᵀ)⁻¹ (b_S − R_S u),     G = Zᵀ Z,   P = R Z,

        where the rows P_S are independent. All of it is exact, and rounded once.
        """
        Z, R, m = beside(self.kernel), Matrix.exact(self.input_set.rows), self.input_set.dimension
        inverse = (Z.transposed @ Z).inverse
        ends = self.input_set.lower, self.input_set.upper
        gains, shifts = [np.eye(m)], [np.zeros(m)]
        for size in range(1, len(self.kernel) + 1):
            for hit in combinations(range(len(self.input_set.rows)), size):
                rows = R.rows_of(hit)
                P = rows @ Z
                if P.rank == size:
                    back = Z @ inverse @ P.transposed @ (P @ inverse @ P.transposed).inverse
                    gain = np.eye(m) - (back @ rows).rounded
                    for sides in product(ends, repeat=size):
                        bounds = Matrix.exact(np.array([[side[i]] for side, i in zip(sides, hit, strict=True)]))
                        gains.append(gain)
                        shifts.append((back @ bounds).rounded[:, 0])
        return Laws(np.array(gains), np.array(shifts))

    def _circuits(self) -> Iterator[list[tuple[int, Fraction]]]:
        """Yield the circuits: pairs of a row of the input set and its factor."""
        pushes = Matrix.exact(self.input_set.rows) @ beside(self.kernel)
        for size in range(1, len(self.kernel) + 2):
            for support in combinations(range(len(pushes)), size):
                relations = pushes.rows_of(support).transposed.null_space
                if len(relations) == 1:
                    yield [(i, relations[0][k, 0]) for k, i in enumerate(support)]


def _fractions(numbers: Array) -> list[Fraction]:
    return [Fraction(v) for v in numbers.tolist()]


def _float_above(number: Fraction) -> float:
    """Round up to float64: infinity beyond its range, and the lowest float64 for numbers below its range."""
    try:
        nearest = float(number)
    except OverflowError:
        return math.inf if number > 0 else -sys.float_info.max
    return nearest if Fraction(nearest) >= number else math.nextafter(nearest, math.inf)
