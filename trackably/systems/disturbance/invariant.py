"""A robustly invariant set of the error: how far a disturbed system under feedback may be from its reference."""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

import numpy as np

from trackably.arrays import Array
from trackably.systems.disturbance.decay import LONGEST, closed_loop, errors_reach, too_slow
from trackably.systems.disturbance.rationals import whole
from trackably.systems.disturbance.sets import DisturbanceSet
from trackably.systems.flat.rationals import exact, fraction
from trackably.systems.linear import LinearSystem

_CONTRACTION, _ROUNDING = 0.5, 1e-9
_TAIL_OF_HEAD, _TAIL_OF_WIDTH = 1e-2, 1e-5
_LEAST_EXTENT = 1e-3


@dataclass(frozen=True, eq=False)
class InvariantSet:
    """Z = ⊕_{i<N} A_Kⁱ W ⊕ A_Kᴺ (1 − α)⁻¹ ⊕_{i<s} A_Kⁱ P with A_K = A + B K: e ∈ Z and w ∈ W imply A_K e + w ∈ Z.

    N = `head` ≥ 1, s = `terms` ≥ 1, 0 ≤ α = `contraction` < 1, and P = {|x_i| ≤ p_i} with p = `box` (n,). It is
    invariant because W ⊆ P and A_Kˢ P ⊆ α P. For then Z_P = (1 − α)⁻¹ ⊕_{i<s} A_Kⁱ P is invariant for P, and so for W
    (Raković et al., 2005: Invariant approximations of the minimal robust positively invariant set). Hence
    A_K Z ⊕ W = ⊕_{i<N} A_Kⁱ W ⊕ A_Kᴺ (W ⊕ A_K Z_P) ⊆ Z. P has an interior where W is flat. The sum over W is part of
    every invariant set that holds 0, so that Z exceeds the smallest one by its last part at most.
    """

    system: LinearSystem
    feedback: Array
    disturbance: DisturbanceSet
    head: int
    terms: int
    contraction: float
    box: Array

    def __post_init__(self) -> None:
        for array in (self.feedback, self.box):
            array.flags.writeable = False

    def support(self, row: Sequence[Fraction]) -> Fraction:
        """Return h_Z(row) = max {row · e : e ∈ Z}, exactly."""
        q, closed = self._closed_loop
        d, (whole_row,) = whole([row])
        (p, (half,)), disturbance = self._whole_box, self.disturbance
        head = tail = 0
        for _ in range(self.head):
            head = head * q + disturbance.whole_support(whole_row)
            whole_row = _times(whole_row, closed)
        for _ in range(self.terms):
            tail = tail * q + sum(abs(r) * size for r, size in zip(whole_row, half, strict=True))
            whole_row = _times(whole_row, closed)
        of_head = Fraction(head, d * disturbance.denominator * q ** (self.head - 1))
        of_tail = Fraction(tail, d * p * q ** (self.head + self.terms - 1))
        return of_head + of_tail / (1 - Fraction(self.contraction))

    def support_of_input(self, row: Sequence[Fraction]) -> Fraction:
        """Return h_Z(Kᵀ row): the largest row · K e of the feedback's inputs, exactly."""
        columns = self.feedback.T.tolist()
        return self.support(
            [sum((Fraction(k) * r for k, r in zip(col, row, strict=True)), Fraction(0)) for col in columns]
        )

    def approximate_support(self, rows: Array) -> Array:
        """Return h_Z(row) in float64 for rows (…, n): shape (…)."""
        total = np.zeros(rows.shape[:-1])
        for i in range(self.head + self.terms):
            part = self.disturbance.support(rows) if i < self.head else np.abs(rows) @ self.box / (1 - self.contraction)
            total, rows = total + part, rows @ self.closed_loop
        return np.asarray(total)

    @cached_property
    def closed_loop(self) -> Array:
        """A_K in float64, shape (n, n)."""
        return closed_loop(self.system, self.feedback)

    @cached_property
    def _closed_loop(self) -> tuple[int, list[list[int]]]:
        """q and q A_K in whole numbers."""
        n = len(self.system.A)
        A_K = exact(self.system.A) + exact(self.system.B) * exact(self.feedback)
        entries = [[fraction(A_K[i, j]) for j in range(n)] for i in range(n)]
        return whole(entries)

    @cached_property
    def _whole_box(self) -> tuple[int, list[list[int]]]:
        return whole([[Fraction(size) for size in self.box.tolist()]])


def _times(row: list[int], matrix: list[list[int]]) -> list[int]:
    return [sum(r * m[j] for r, m in zip(row, matrix, strict=True)) for j in range(len(row))]


def invariant_set(
    system: LinearSystem, feedback: Array, disturbance: DisturbanceSet, rows: Array, widths: Array, scales: Array
) -> InvariantSet:
    """Return an invariant set that exceeds the smallest one by about a hundredth of its size in each of the `rows`.

    `rows` (r, n) are those that matter, with `widths` (r,) between their bounds; `scales` (n,) are units of the states.
    For W = {0} it is {0}. Raises NoInvariantSetError where the error does not decay, or too slowly.
    """
    A_K, n = closed_loop(system, feedback), len(scales)
    reach = errors_reach(A_K, disturbance, np.vstack([np.eye(n), -np.eye(n)]), scales)
    extents = np.maximum(reach[:n], reach[n:])
    size = float(np.max(extents / scales))
    if not size:
        return InvariantSet(system, feedback, disturbance, 1, 1, 0.0, np.zeros(n))
    box = np.maximum(extents, _LEAST_EXTENT * size * scales) * (1 + _ROUNDING)
    terms, contraction = _contraction(A_K, box)
    head = _head(A_K, disturbance, box, terms, contraction, rows, widths)
    return InvariantSet(system, feedback, disturbance, head, terms, contraction, box)


def _contraction(A_K: Array, box: Array) -> tuple[int, float]:
    """Return s and α with A_Kˢ P ⊆ α P for the box P, α about a half at most."""
    power = A_K
    for s in range(1, LONGEST):
        contraction = float(np.max(np.abs(power) @ box / box))
        if contraction <= _CONTRACTION:
            return s, contraction * (1 + _ROUNDING) + _ROUNDING
        power = power @ A_K
    raise too_slow(A_K)


def _head(
    A_K: Array, disturbance: DisturbanceSet, box: Array, terms: int, contraction: float, rows: Array, widths: Array
) -> int:
    """Return the smallest N for which the last part of Z is small in each row, compared with the first or its width."""
    powers, sizes, head = [rows], [np.abs(rows) @ box], np.zeros((2, len(rows)))
    for N in range(1, LONGEST):
        head += disturbance.support(np.stack([powers[N - 1], -powers[N - 1]]))
        while len(sizes) < N + terms:
            powers.append(powers[-1] @ A_K)
            sizes.append(np.abs(powers[-1]) @ box)
        tail = np.sum(sizes[N:], axis=0) / (1 - contraction)
        if np.all(tail <= np.maximum(_TAIL_OF_HEAD * np.min(head, axis=0), _TAIL_OF_WIDTH * widths)):
            return N
    raise too_slow(A_K)
