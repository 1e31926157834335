"""Flat outputs in discrete time: signals that determine every trajectory of a controllable system, and are free.

z_c(k) = q_c x(k), where q_c annihilates B, A B, …, A^(κ_c − 2) B. Then z_c(k + j) = q_c Aʲ x(k) for j < κ_c, so that
these numbers are coordinates of the state, and z(k + κ) determines the input. Solving for both (with c = 0 here),

    x(k) = Σ_c Σ_(j < κ_c) M_cj z_c(k + j),        u(k) = Σ_c Σ_(j ≤ κ_c) N_cj z_c(k + j),

for arbitrary signals z. All numbers are exact rationals, computed from the float64 entries of A, B and c, so that the
system follows x(k) with u(k) exactly: M_c(j−1) = A M_cj + B N_cj.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import accumulate

import numpy as np
from flint import fmpq, fmpq_mat

from trackably.arrays import Array
from trackably.systems.flat.functional import Functional
from trackably.systems.flat.rationals import beside, columns_of, exact, fraction, kernel, rounded, row_of, stacked
from trackably.systems.flat.trajectory import Coordinate
from trackably.systems.formulas.wording import weighted_sum_text

_WORST_CONDITION = 1e13
_REFUSED = "system: must be controllable, so that its states can follow a reference"


@dataclass(frozen=True)
class Flatness:
    """States x_i and inputs u_i as functions of the flat outputs, and the `orders` κ_c of the flat outputs."""

    states: tuple[Coordinate, ...]
    inputs: tuple[Coordinate, ...]
    orders: tuple[int, ...]


def flatness(A: Array, B: Array, c: Array, sampling_time: float, states: Sequence[str]) -> Flatness:
    """Return flat outputs of the controllable system x(k+1) = A x(k) + B u(k) + c, with names of its `states`.

    With as many independent inputs as states, these are the states themselves. Otherwise they are made of the first
    independent columns of [B, A B, …] (Luenberger's choice), each in the unit of the first state that it moves at rest.
    Of several inputs with the same effect, the one of smallest Euclidean norm is taken.

    Shapes: A (n, n), B (n, m), c (n,). ValueError: the system is not controllable, or too close to such a system for
    float64.
    """
    exact_A, exact_B, offset = exact(A), exact(B), exact(c[:, None])
    reduced = columns_of(exact_B, _independent_columns(exact_B))
    orders = _chains(exact_A, reduced, states)
    q = _outputs(exact_A, reduced, orders)
    # With ζ the z_c(k + j) for j < κ_c, ω the z_c(k + κ_c), and B u = B_r w:  ζ = Q x + d,  ω = P x + G w + e.
    Q, d = _shifted(q, exact_A, offset, [(i, j) for i, order in enumerate(orders) for j in range(order)])
    P, e = _shifted(q, exact_A, offset, list(enumerate(orders)))
    G = stacked([row_of(q, i) * exact_A ** (order - 1) * reduced for i, order in enumerate(orders)])
    # So x = Q⁻¹ (ζ − d) and w = G⁻¹ (ω − P x − e).
    by_lower, by_highest = Q.inv(), _least_norm(reduced, exact_B) * G.inv()
    feedback = -1 * by_highest * P
    state_offset = -1 * by_lower * d
    state_weights = _by_output(by_lower, orders)
    input_weights = [
        [[*weights, fraction(by_highest[row, i])] for row, weights in enumerate(of_output)]
        for i, of_output in enumerate(_by_output(feedback * by_lower, orders))
    ]
    scales = [_scale(of_output) for of_output in state_weights]
    return Flatness(
        _functionals(state_weights, scales, state_offset, sampling_time),
        _functionals(input_weights, scales, feedback * state_offset - by_highest * e, sampling_time),
        tuple(orders),
    )


def outputs_in_states(flat: Flatness) -> list[list[Fraction]]:
    """Return the row q_c of each flat output z_c = q_c x of a linear system, exactly."""
    n, places = len(flat.states), [(c, j) for c, order in enumerate(flat.orders) for j in range(order)]
    states = [x for x in flat.states if isinstance(x, Functional)]
    entries = [x.weights[c][j] for x in states for c, j in places]
    inverse = fmpq_mat(n, n, [fmpq(w.numerator, w.denominator) for w in entries]).inv()
    return [[fraction(inverse[place, i]) for i in range(n)] for place, (_, j) in enumerate(places) if j == 0]


def _shifted(q: fmpq_mat, A: fmpq_mat, offset: fmpq_mat, which: list[tuple[int, int]]) -> tuple[fmpq_mat, fmpq_mat]:
    """Return Q and d such that z_i(k + j) = Q x(k) + d with u = 0, one row for each pair (i, j)."""
    return (
        stacked([row_of(q, i) * A**j for i, j in which]),
        stacked([row_of(q, i) * _accumulated(A, j) * offset for i, j in which]),
    )


def _by_output(matrix: fmpq_mat, orders: list[int]) -> list[list[list[Fraction]]]:
    """Cut the columns by flat output: [i][row][j] is the weight of z_i(k + j) in this row."""
    starts = accumulate(orders[:-1], initial=0)
    return [
        [[fraction(matrix[row, start + j]) for j in range(order)] for row in range(matrix.nrows())]
        for start, order in zip(starts, orders, strict=True)
    ]


def _functionals(
    by_output: list[list[list[Fraction]]], scales: list[Fraction], offset: fmpq_mat, sampling_time: float
) -> tuple[Functional, ...]:
    return tuple(
        Functional(
            tuple(tuple(w / scale for w in rows[i]) for rows, scale in zip(by_output, scales, strict=True)),
            fraction(offset[i, 0]),
            sampling_time,
        )
        for i in range(offset.nrows())
    )


def _scale(rows: list[list[Fraction]]) -> Fraction:
    """Return the gain, at rest, from a flat output to the first state that moves with it."""
    return next((gain for row in rows if (gain := sum(row, Fraction(0)))), Fraction(1))


def _chains(A: fmpq_mat, B: fmpq_mat, states: Sequence[str]) -> list[int]:
    """Return κ_c: how many of B_c, A B_c, … are among the first independent columns of [B, A B, …]."""
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
            f"{_REFUSED}: its inputs reach {len(taken)} of {n} dimensions, and none of them ever changes "
            f"{weighted_sum_text(_never_moved(taken, n), states)}"
        )
    if not (condition := _condition(beside(taken))) < _WORST_CONDITION:
        raise ValueError(f"{_REFUSED}, but nearly is not: [B, A B, …] has condition number {condition:.1g}")
    return orders


def _never_moved(reached: list[fmpq_mat], n: int) -> list[Fraction]:
    """Return a row that maps every reached column to zero, scaled to a largest entry of 1."""
    row = kernel(beside(reached).transpose())[0] if reached else fmpq_mat(n, 1, [fmpq(int(i == 0)) for i in range(n)])
    weights = [fraction(row[i, 0]) for i in range(n)]
    return [w / max(weights, key=abs) for w in weights]


def _outputs(A: fmpq_mat, B: fmpq_mat, orders: list[int]) -> fmpq_mat:
    """Return the rows q_c, which map the last column of chain c to 1 and all other chosen columns to zero."""
    n, m = B.nrows(), B.ncols()
    if m == n:
        return fmpq_mat(n, n, [fmpq(int(i == j)) for i in range(n) for j in range(n)])
    columns = [A**j * columns_of(B, [c]) for c, order in enumerate(orders) for j in range(order)]
    inverse = beside(columns).inv()
    lasts = np.cumsum(orders) - 1
    return stacked([row_of(inverse, int(last)) for last in lasts])


def _independent_columns(B: fmpq_mat) -> list[int]:
    """Return the first columns that are a basis of the range of B. ValueError: they are nearly dependent."""
    kept: list[int] = []
    for c in range(B.ncols()):
        if columns_of(B, [*kept, c]).rank() == len(kept) + 1:
            kept.append(c)
    chosen = columns_of(B, kept)
    if kept and not _condition(chosen) < _WORST_CONDITION:
        raise ValueError(
            "system: the columns of B must be clearly independent or exactly dependent, but are neither; for "
            "redundant inputs, give columns that are exact multiples or sums of each other"
        )
    return kept


def _least_norm(reduced: fmpq_mat, B: fmpq_mat) -> fmpq_mat:
    """Return the matrix from w to the smallest u with B u = B_r w: with B = B_r F it is Fᵀ (F Fᵀ)⁻¹."""
    transposed = reduced.transpose()
    F = (transposed * reduced).inv() * transposed * B
    return F.transpose() * (F * F.transpose()).inv()


def _accumulated(A: fmpq_mat, steps: int) -> fmpq_mat:
    """Return I + A + … + A^(steps − 1)."""
    total = A * 0
    for j in range(steps):
        total = total + A**j
    return total


def _condition(matrix: fmpq_mat) -> float:
    """Return the condition number of the matrix with columns scaled to unit length, so that units do not matter."""
    columns = rounded(matrix)
    return float(np.linalg.cond(columns / np.linalg.norm(columns, axis=0)))
