"""Linear systems with several states and inputs, and their flat outputs."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Self

import numpy as np
import scipy

from trackably.arguments import array, is_number, names, numbers, positive
from trackably.arrays import Array, ArrayLike
from trackably.checker.formulas import IDENTIFIER
from trackably.checker.subject import weighted_sum_text
from trackably.systems.rationals import Rationals, exact, inverse, null_space, row_echelon
from trackably.systems.trajectories import Functional, Trajectory


def require_names(names: Iterable[object]) -> None:
    """Raise ValueError for the first invalid name of a state or an input.

    A valid name begins with a letter or _, goes on with letters, digits, _ and -, and may end with square or round
    brackets around an index or a unit, such as q[1] or v(m/s). Letters are Latin or Greek.
    """
    for name in names:
        if not (isinstance(name, str) and re.fullmatch(IDENTIFIER, name)):
            raise ValueError(
                "system: a name of a state or an input must be a letter or _, then letters, digits, _ and -, then "
                f"indices or units in brackets such as q[1] or v(m/s), 60 characters at most, got {name!a:.80}"
            )


# Flat outputs in discrete time: signals that can be chosen freely and determine every trajectory of a system.
#
# z_c(k) = q_c x(k), where q_c annihilates B, A B, …, A^(κ_c − 2) B. Then z_c(k + j) = q_c Aʲ x(k) for j < κ_c, so that
# these numbers are coordinates of the state, and z(k + κ) determines the input. Solving for both (with c = 0 here),
#
#     x(k) = Σ_c Σ_(j < κ_c) M_cj z_c(k + j),        u(k) = Σ_c Σ_(j ≤ κ_c) N_cj z_c(k + j),
#
# for arbitrary signals z. All numbers are exact rationals, computed from the float64 entries of A, B and c, so that the
# system follows x(k) with u(k) exactly: M_c(j−1) = A M_cj + B N_cj.

_WORST_CONDITION = 1e13  # columns with a larger condition number count as nearly dependent
_REFUSED = "system: must be controllable, so that its states can follow a reference"


@dataclass(frozen=True)
class Flatness:
    """States x_i and inputs u_i as functions of the flat outputs, and the `orders` κ_c of the flat outputs.

    For a linear system, `outputs` are the rows q_c of its flat outputs z_c = q_c x, exactly.
    """

    states: tuple[Trajectory, ...]
    inputs: tuple[Trajectory, ...]
    orders: tuple[int, ...]
    outputs: Sequence[Sequence[Fraction]] = ()


def _trajectories(by_output: list[Rationals], offset: Rationals, sampling_time: float) -> tuple[Trajectory, ...]:
    return tuple(
        Trajectory.of(Functional(constant, tuple(tuple(of[i]) for of in by_output), sampling_time))
        for i, constant in enumerate(offset)
    )


def _chains(A: Rationals, B: Rationals, states: Sequence[str]) -> list[int]:
    """Return κ_c for each input c: how many of B_c, A B_c, … are among the first independent columns of [B, A B, …].

    ValueError: the system is not controllable, or nearly not.
    """
    n, m = B.shape
    every = B
    while len(pivots := row_echelon(every)[1]) < n and every.shape[1] < n * m:
        every = np.hstack([every, A @ every[:, -m:]])
    taken = every[:, pivots]  # if A^j B_c depends on columns before it, so do later powers
    if len(pivots) < n:
        row = null_space(taken.T)[:, 0]  # orthogonal to every direction that inputs reach
        raise ValueError(
            f"{_REFUSED}, but its inputs reach {len(pivots)} of {n} dimensions, and none of them ever changes "
            f"{weighted_sum_text(row / max(row, key=abs), states)}"
        )
    if not (condition := _condition(taken)) < _WORST_CONDITION:
        raise ValueError(
            f"{_REFUSED}, but is nearly uncontrollable: [B, A B, …] has the condition number {condition:.1g}, expected "
            f"less than {_WORST_CONDITION:g}; for redundant inputs, give columns of B that are exact multiples or sums "
            "of each other"
        )
    return [sum(pivot % m == c for pivot in pivots) for c in range(m)]


def _outputs(A: Rationals, B: Rationals, orders: list[int]) -> Rationals:
    """Return the rows q_c of the flat outputs z_c = q_c x.

    They satisfy q_c A^(κ_c − 1) B_c = 1, and q_c Aʲ B_d = 0 for all other d and j < κ_d. With as many inputs as states,
    the q_c are unit vectors. `orders` are the κ_c.
    """
    n, m = B.shape
    if m == n:
        return exact(np.eye(n))
    columns = [np.linalg.matrix_power(A, j) @ B[:, c] for c, order in enumerate(orders) for j in range(order)]
    found: Rationals = inverse(np.column_stack(columns))[np.cumsum(orders) - 1]
    return found


def _pseudo_inverse(independent: Rationals, B: Rationals) -> Rationals:
    """Return the matrix that maps B u to the smallest input with the effect of u. B_r are `independent` columns of B.

    With F = (B_rᵀ B_r)⁻¹ B_rᵀ B, so that B = B_r F, it is Fᵀ (F Fᵀ)⁻¹ (B_rᵀ B_r)⁻¹ B_rᵀ (Penrose).
    """
    left = inverse(independent.T @ independent) @ independent.T
    F = left @ B
    found: Rationals = F.T @ inverse(F @ F.T) @ left
    return found


def _condition(matrix: Rationals) -> float:
    """Return the condition number of the matrix with columns scaled to unit length, so that units do not matter."""
    columns = matrix.astype(float)
    return float(np.linalg.cond(columns / np.linalg.norm(columns, axis=0)))


# Linear systems with several states and inputs.


@dataclass(frozen=True, eq=False)
class LinearSystem:
    """x(k+1) = A x(k) + B u(k) + c with A (n, n), B (n, m), c (n,), one step every `sampling_time` [s].

    A number as third argument is the sampling time, LinearSystem(A, B, 0.1), and a list of numbers is c. `states` and
    `inputs` are names, all different. By default, c is zero and the names are x1, x2, … and u1, u2, …, or `state` and
    `input` if there is one of each. ValueError: shapes do not fit, an entry is not finite, names repeat or are invalid
    (`require_names`), or the sampling time is not positive. TypeError: entries are no real numbers or names, or the
    sampling time is missing.
    """

    A: Array
    B: Array
    c: Array
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    sampling_time: float

    def __init__(
        self,
        A: ArrayLike,
        B: ArrayLike,
        c: ArrayLike | None = None,
        states: Sequence[str] = (),
        inputs: Sequence[str] = (),
        *,
        sampling_time: float | None = None,
    ) -> None:
        c, T = (None, c) if sampling_time is None and is_number(c) else (c, sampling_time)
        if T is None:
            raise TypeError(
                "system: sampling_time: expected a number, as in LinearSystem(A, B, sampling_time=0.1), got None"
            )
        A = numbers("system: A", A)
        if A.ndim != 2 or len(A) != A.shape[1]:
            raise ValueError(f"system: A must be a square matrix, got shape {A.shape}")
        A, B = array("system: A", A, None, None), array("system: B", B, len(A), None)
        n, m = B.shape
        alone = (n, m) == (1, 1)
        states = names("system: states", states) or (("state",) if alone else tuple(f"x{i + 1}" for i in range(n)))
        inputs = names("system: inputs", inputs) or (("input",) if alone else tuple(f"u{i + 1}" for i in range(m)))
        require_names((*states, *inputs))
        if len(states) != n or len(inputs) != m or len({*states, *inputs}) != n + m:
            raise ValueError(
                f"system: expected different names of {n} states and {m} inputs, got states {states} and inputs "
                f"{inputs}"
            )
        c, T = array("system: c", np.zeros(n) if c is None else c, n), positive("system: sampling_time", T)
        vars(self).update(A=A, B=B, c=c, states=states, inputs=inputs, sampling_time=T)

    @classmethod
    def scalar(cls, a: float, b: float, c: float = 0.0, *, sampling_time: float) -> Self:
        """Return the system x(k+1) = a x(k) + b u(k) + c with one state and one input."""
        return cls([[a]], [[b]], [c], sampling_time=sampling_time)

    @classmethod
    def discretised(
        cls,
        A: ArrayLike,
        B: ArrayLike,
        sampling_time: float,
        c: ArrayLike | None = None,
        states: Sequence[str] = (),
        inputs: Sequence[str] = (),
    ) -> Self:
        """Sample ẋ = A x + B u + c with the input held over each `sampling_time` [s]; exact at the sampling instants.

        exp([[A, I], [0, 0]] T_s) has the discrete A and Γ in its upper rows, and Γ B and Γ c are the discrete B and c.
        Each column of Γ B is summed up in the same order, so that columns of B that are multiples of each other by
        ± 2^k remain exact multiples, and redundant inputs stay redundant.
        """
        continuous = cls(A, B, c, states, inputs, sampling_time=sampling_time)
        n = len(continuous.A)
        generator = np.block([[continuous.A, np.eye(n)], [np.zeros((n, 2 * n))]])
        held, gamma = np.hsplit(scipy.linalg.expm(generator * sampling_time)[:n], 2)
        B_held = sum(np.multiply.outer(of, row) for of, row in zip(gamma.T, continuous.B, strict=True))
        return replace(continuous, A=held, B=B_held, c=gamma @ continuous.c)

    def successor(self, x: Array, u: Array) -> Array:
        """Return A x + B u + c for x of shape (…, n) and u of shape (…, m); the result has shape (…, n)."""
        return np.asarray(np.asarray(x) @ self.A.T + np.asarray(u) @ self.B.T + self.c)

    def slopes(self, x: Array, u: Array) -> tuple[Array, Array]:
        """Return ∂f/∂x = A and ∂f/∂u = B at x of shape (…, n) and u (…, m): shapes (…, n, n) and (…, n, m)."""
        shape = np.broadcast_shapes(np.shape(x)[:-1], np.shape(u)[:-1])
        return np.broadcast_to(self.A, (*shape, *self.A.shape)), np.broadcast_to(self.B, (*shape, *self.B.shape))

    def flatness(self) -> Flatness:
        """Return states and inputs as functions of flat outputs.

        If there are as many independent inputs as states, the flat outputs are the states themselves. Otherwise they
        follow from the first independent columns of [B, A B, …] (Luenberger's choice). Each is scaled such that, at
        rest, the first state that depends on it changes by as much as the flat output. Of several inputs with the same
        effect, the one with the smallest Euclidean norm is chosen. ValueError: the system is not controllable, or too
        close to an uncontrollable one for float64.
        """
        A, B, offset, T = exact(self.A), exact(self.B), exact(self.c), self.sampling_time
        independent = B[:, row_echelon(B)[1]]  # the first columns that are a basis of the range of B
        orders = _chains(A, independent, self.states)
        q = _outputs(A, independent, orders)
        Q, d = [], []  # z_c(k + j) = Q x(k) + d for u = 0 and j < κ_c
        for row, order in zip(q, orders, strict=True):
            moved, constant = row, Fraction(0)
            for _ in range(order):
                Q.append(moved)
                d.append(constant)
                moved, constant = moved @ A, constant + moved @ offset
        by_outputs = inverse(np.vstack(Q))
        x_offset = -(by_outputs @ np.array(d, dtype=object))
        gains = np.split(by_outputs, np.cumsum(orders)[:-1], axis=1)  # [c][i, j]: weight of z_c(k + j) in x_i
        # At rest, z_c is constant, so that the sum of its weights in a state counts. The first nonzero sum scales z_c.
        scales = [next((gain for gain in of.sum(axis=1) if gain), Fraction(1)) for of in gains]
        x_weights, none = [of / scale for of, scale in zip(gains, scales, strict=True)], exact(np.zeros((len(A), 1)))
        inputs = _pseudo_inverse(independent, B)  # maps x(k + 1) − A x(k) − c to u(k)
        u_weights = [inputs @ (np.hstack([none, of]) - A @ np.hstack([of, none])) for of in x_weights]
        return Flatness(
            _trajectories(x_weights, x_offset, T),
            _trajectories(u_weights, inputs @ (x_offset - A @ x_offset - offset), T),
            tuple(orders),
            [(scale * row).tolist() for scale, row in zip(scales, q, strict=True)],
        )
