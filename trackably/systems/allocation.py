"""Control allocation: the effects that redundant inputs can attain in the input set, and the smallest input for each.

If the columns of Z span the null space of B, then u and u + Z v have the same effect on a linear system for every v.
The effect of u is attainable if some v satisfies lower ≤ R (u + Z v) ≤ upper. This is the case if and only if

    Σ_(λ_i > 0) λ_i lower_i + Σ_(λ_i < 0) λ_i upper_i  ≤  λᵀ R u  ≤  Σ_(λ_i > 0) λ_i upper_i + Σ_(λ_i < 0) λ_i lower_i

for every circuit λ of the rows of R Z: a λ ≠ 0 with λᵀ R Z = 0 of minimal support. Up to a factor there are finitely
many circuits. (Necessity is obvious. Sufficiency is Farkas' lemma, as every λ with λᵀ R Z = 0 is a sum of circuits that
agree with it in sign.)
"""

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import combinations, product
from typing import NamedTuple

import numpy as np

from trackably.arrays import Array
from trackably.checker.redundancy import demands
from trackably.systems.intervals import Interval
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import BoundedRow, Polytope
from trackably.systems.rationals import Rationals, exact, float_above, float_below, inverse, null_space, row_echelon

_MAX_LAWS = 10_000  # an input set with more candidates for the smallest input (`Allocation.laws`) is refused
_AT_ONCE = 2**22  # `smallest` treats inputs in blocks whose candidates have at most about this many numbers
ROUNDING = 2.0**-48
"""A candidate still counts as admissible if it exceeds a bound by at most this part of the sum of the absolute values
of the terms of the row, because rounding can cause such an excess."""


class AllocationLaws(NamedTuple):
    """C candidates for the smallest input, affine in u: `gains`[c] u + `shifts`[c]; shapes (C, m, m) and (C, m)."""

    gains: Array
    shifts: Array


@dataclass(frozen=True, eq=False)
class Allocation:
    """The choice among redundant inputs in an `input_set` {u : lower ≤ R u ≤ upper}.

    The columns Z of `kernel` span the null space of B, so that u and u + Z v have the same effect.
    """

    input_set: Polytope
    kernel: Rationals

    @classmethod
    def of(cls, system: LinearSystem, input_set: Polytope) -> "Allocation | None":
        """Return the allocation; None if no input is redundant or no input is bounded.

        ValueError: a bound moves in time, or there are too many candidates for the smallest input (`laws`).
        """
        kernel = null_space(exact(system.B))
        free = kernel.shape[1]
        if not free or not len(input_set.rows):
            return None
        if input_set.moves:
            raise ValueError(
                f"system: redundant inputs need constant bounds, but bounds of the input set {input_set} move in time"
            )
        sizes = range(1, free + 2)
        if sum(math.comb(len(input_set.rows), size) * 2**size for size in sizes) > _MAX_LAWS:
            raise ValueError(
                f"system: {free} redundant inputs are too many for an input set of {len(input_set.rows)} rows, as the "
                f"smallest input would have more than {_MAX_LAWS} candidates; give fewer inputs or rows"
            )
        return cls(input_set, kernel)

    @property
    def attainable(self) -> list[BoundedRow]:
        """Rows with bounds, which an input u satisfies if and only if some input in the set has the same effect as u.

        ValueError: the input set has no interior.
        """
        found: dict[tuple[Fraction, ...], tuple[Fraction, Fraction]] = {}
        for demand in demands(self.kernel.T.tolist(), self.input_set.checked.rows):
            scale = max(demand.row, key=abs) or Fraction(1)
            direction = tuple(r / scale for r in demand.row)
            low, high = sorted((demand.low / scale, demand.high / scale))
            lowest, highest = found.get(direction, (low, high))
            low, high = found[direction] = max(low, lowest), min(high, highest)
            if not (low < high if any(direction) else low <= 0 <= high):  # zero row: if 0 is outside, U is empty
                raise ValueError(f"set: must have an interior, but no input lies strictly inside {self.input_set}")
        return [(row, Interval(float_above(low), float_below(high))) for row, (low, high) in found.items() if any(row)]

    def smallest(self, u: Array) -> Array:
        """Return the input of smallest Euclidean norm in the input set that has the same effect as u (…, m).

        u must be orthogonal to the null space of B. If no input in the set has this effect, return the candidate of
        `laws` that violates the set least, relative to the widths of its rows.
        """
        gains, shifts = self.laws
        flat = u.reshape(-1, u.shape[-1])
        blocks = np.array_split(flat, 1 + flat.size * len(shifts) // _AT_ONCE)
        chosen = np.concatenate([self._choice(block) for block in blocks]).reshape(u.shape[:-1])
        return np.asarray(np.einsum("...ij,...j->...i", gains[chosen], u) + shifts[chosen])

    def _choice(self, u: Array) -> Array:
        """Return the index of the smallest admissible input among `laws` for each u (k, m); shape (k,)."""
        choice = np.zeros(len(u), dtype=int)  # the first candidate is u itself
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
    def laws(self) -> AllocationLaws:
        """Candidates for the smallest admissible input, as affine functions of u; the first of them is u itself.

        For each other candidate, some rows S of R are at their lower or upper bounds b_S. The candidate is the smallest
        such input that has the effect of u. It is u + Z v with

            v = G⁻¹ P_Sᵀ (P_S G⁻¹ P_Sᵀ)⁻¹ (b_S − R_S u),     G = Zᵀ Z,   P = R Z,

        where the rows P_S are independent. Gains and shifts are computed exactly, and rounded once.
        """
        Z, R, m = self.kernel, exact(self.input_set.rows), self.input_set.dimension
        metric = inverse(Z.T @ Z)
        ends = exact(self.input_set.lower), exact(self.input_set.upper)
        gains, shifts = [np.eye(m)], [np.zeros(m)]
        for size in range(1, Z.shape[1] + 1):
            for hit in map(list, combinations(range(len(R)), size)):
                P = R[hit] @ Z
                if len(row_echelon(P)[1]) == size:
                    back = Z @ metric @ P.T @ inverse(P @ metric @ P.T)
                    gain = np.eye(m) - (back @ R[hit]).astype(float)
                    for sides in product(ends, repeat=size):
                        bounds = np.array([side[i] for side, i in zip(sides, hit, strict=True)], dtype=object)
                        gains.append(gain)
                        shifts.append((back @ bounds).astype(float))
        return AllocationLaws(np.array(gains), np.array(shifts))
