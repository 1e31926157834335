"""Flat outputs in discrete time: signals in which every trajectory of a controllable system can be written, and freely.

z_c(k) = q_c x(k), where q_c annihilates B, A B, …, A^(κ_c − 2) B. Then z_c(k + j) = q_c Aʲ x(k) for j < κ_c, so that
these numbers are coordinates of the state, and z(k + κ) determines the input. Solved for both (c = 0 here),

    x(k) = Σ_c Σ_(j < κ_c) M_cj z_c(k + j),        u(k) = Σ_c Σ_(j ≤ κ_c) N_cj z_c(k + j),

whatever the signals z are. All numbers are exact rationals made of the float64 entries of A, B and c. So the system
follows x(k) with u(k) exactly: M_c(j−1) = A M_cj + B N_cj.
"""

from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from flint import fmpq, fmpq_mat

from trackable.systems.flat.functional import Functional
from trackable.systems.flat.rationals import beside, columns_of, exact, fraction, kernel, rounded, row_of, stacked
from trackable.systems.flat.trajectory import Coordinate
from trackable.systems.linear import LinearSystem
from trackable.systems.wording import written

_WORST_CONDITION = 1e13
_REFUSED = "system: must be controllable, so that its states can be led where a reference wants them"


@dataclass(frozen=True)
class Flatness:
    """`states[i]` is x_i and `inputs[i]` is u_i, in terms of the flat outputs; `orders` are their κ_c."""

    states: tuple[Functional, ...]
    inputs: tuple[Coordinate, ...]
    orders: tuple[int, ...]


def flatness(system: LinearSystem) -> Flatness:
    """Flat outputs of a controllable system: the states themselves where inputs move each of them at will.

    Otherwise they come from the columns of [B, A B, …], the first independent ones (Luenberger's choice), each in the
    unit of the first state that it moves at rest. Of many inputs that do the same the smallest (Euclidean) is taken.
    Raises ValueError where the system is not controllable, or so barely that float64 samples could not tell.
    """
    A, B, offset = exact(system.A), exact(system.B), exact(system.c[:, None])
    independent = _independent_columns(B)
    reduced = columns_of(B, independent)
    chosen = _chains(system, A, reduced)
    q = _outputs(A, reduced, chosen)
    coordinates = stacked([row_of(q, c) * A**j for c, order in enumerate(chosen) for j in range(order)])
    drift = stacked(
        [row_of(q, c) * _accumulated(A, j) * offset for c, order in enumerate(chosen) for j in range(order)]
    )
    back = coordinates.inv()
    # z_c(k + κ_c) = q_c A^κ_c x + G_c w + drift
    ahead = stacked([row_of(q, c) * A**order for c, order in enumerate(chosen)])
    gain = stacked([row_of(q, c) * A ** (order - 1) * reduced for c, order in enumerate(chosen)]).inv()
    beyond = stacked([row_of(q, c) * _accumulated(A, order) * offset for c, order in enumerate(chosen)])
    spread = _least(reduced, B)
    state_offset = -1 * back * drift
    inward = -1 * spread * gain * ahead
    input_offset = inward * state_offset - spread * gain * beyond
    by_output, outward = inward * back, spread * gain
    at = 0
    states: list[list[list[Fraction]]] = []
    inputs: list[list[list[Fraction]]] = []
    for c, order in enumerate(chosen):
        states.append([[fraction(back[i, at + j]) for j in range(order)] for i in range(back.nrows())])
        inputs.append([
            [*(fraction(by_output[i, at + j]) for j in range(order)), fraction(outward[i, c])]
            for i in range(by_output.nrows())
        ])  # fmt: skip
        at += order
    scales = [_scale(channel) for channel in states]
    return Flatness(
        _functionals(states, scales, state_offset, system.sampling_time),
        _functionals(inputs, scales, input_offset, system.sampling_time),
        tuple(chosen),
    )


def _functionals(
    channels: list[list[list[Fraction]]], scales: list[Fraction], offset: fmpq_mat, sampling_time: float
) -> tuple[Functional, ...]:
    return tuple(
        Functional(
            tuple(tuple(w / scale for w in channel[i]) for channel, scale in zip(channels, scales, strict=True)),
            fraction(offset[i, 0]),
            sampling_time,
        )
        for i in range(offset.nrows())
    )


def _scale(channel: list[list[Fraction]]) -> Fraction:
    """How far the first state that moves at all moves with the flat output, at rest."""
    return next((gain for row in channel if (gain := sum(row, Fraction(0)))), Fraction(1))


def _chains(system: LinearSystem, A: fmpq_mat, B: fmpq_mat) -> list[int]:
    """κ_c: how many of B_c, A B_c, … are taken when the first independent columns of [B, A B, …] are."""
    n, m = B.nrows(), B.ncols()
    if m == n:
        return [1] * n
    taken: list[fmpq_mat] = []
    orders, alive, power = [0] * m, [True] * m, B
    while len(taken) < n and any(alive):
        for c in range(m):
            if alive[c] and len(taken) < n:
                column = columns_of(power, [c])
                alive[c] = beside([*taken, column]).rank() == len(taken) + 1
                if alive[c]:
                    taken.append(column)
                    orders[c] += 1
        power = A * power
    if len(taken) < n:
        raise ValueError(
            f"{_REFUSED}: its inputs reach {len(taken)} of {n} dimensions, and none of them ever moves "
            f"{written(_never_moved(taken, n), system.states)}"
        )
    if not (condition := _condition(beside(taken))) < _WORST_CONDITION:
        raise ValueError(f"{_REFUSED}, but is so barely: [B, A B, …] has condition number {condition:.1g}")
    return orders


def _never_moved(reached: list[fmpq_mat], n: int) -> list[Fraction]:
    """A row that maps everything that is reached to zero; its largest number is 1."""
    row = kernel(beside(reached).transpose())[0] if reached else fmpq_mat(n, 1, [fmpq(int(i == 0)) for i in range(n)])
    weights = [fraction(row[i, 0]) for i in range(n)]
    return [w / max(weights, key=abs) for w in weights]


def _outputs(A: fmpq_mat, B: fmpq_mat, orders: list[int]) -> fmpq_mat:
    """The rows q_c: all chosen columns but the last of its own chain are mapped to zero, that one to 1."""
    n, m = B.nrows(), B.ncols()
    if m == n:
        return fmpq_mat(n, n, [fmpq(int(i == j)) for i in range(n) for j in range(n)])
    columns = [A**j * columns_of(B, [c]) for c, order in enumerate(orders) for j in range(order)]
    inverse = beside(columns).inv()
    lasts = np.cumsum(orders) - 1
    return stacked([row_of(inverse, int(last)) for last in lasts])


def _independent_columns(B: fmpq_mat) -> list[int]:
    kept: list[int] = []
    for c in range(B.ncols()):
        if columns_of(B, [*kept, c]).rank() == len(kept) + 1:
            kept.append(c)
    chosen = columns_of(B, kept)
    if kept and not _condition(chosen) < _WORST_CONDITION:
        raise ValueError(
            "system: the columns of B must be clearly independent or exactly dependent, but are neither; of inputs "
            "that push alike, give columns that are multiples or sums of each other to the last digit"
        )
    return kept


def _least(reduced: fmpq_mat, B: fmpq_mat) -> fmpq_mat:
    """Takes w to the smallest u with B u = B_r w: with B = B_r F that is Fᵀ (F Fᵀ)⁻¹ w."""
    transposed = reduced.transpose()
    F = (transposed * reduced).inv() * transposed * B
    return F.transpose() * (F * F.transpose()).inv()


def _accumulated(A: fmpq_mat, steps: int) -> fmpq_mat:
    """I + A + … + A^(steps − 1)."""
    total = A * 0
    for j in range(steps):
        total = total + A**j
    return total


def _condition(matrix: fmpq_mat) -> float:
    """Of the matrix with columns of unit length: how independent they are, whatever their units."""
    columns = rounded(matrix)
    return float(np.linalg.cond(columns / np.linalg.norm(columns, axis=0)))
