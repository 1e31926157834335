"""Systems with redundant inputs and their input sets, and a linear program that says what is attainable."""

import numpy as np
from scipy.optimize import linprog

from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope

ONE_STATE = LinearSystem(np.array([[0.5]]), np.array([[1.0, 1.0]]), sampling_time=0.1)
TWO_STATES = LinearSystem(
    np.array([[0.5, 0.1], [0.0, 0.9]]), np.array([[1.0, 0.0, 1.0, 0.5], [0.0, 1.0, 1.0, -0.3]]), sampling_time=0.1
)
THREE_FOR_ONE = LinearSystem(np.array([[0.9]]), np.array([[2.0, -1.0, 0.0]]), sampling_time=0.1)
"""Of which the last one does nothing."""


def regular_polygon(sides: int) -> Polytope:
    angles = 2 * np.pi * np.arange(sides) / sides
    return Polytope.halfspaces(np.column_stack([np.cos(angles), np.sin(angles)]), np.ones(sides))


def random_case(seed: int) -> tuple[LinearSystem, Polytope]:
    """Up to two states, up to two inputs more; boxes, some sides free, or other rows as well."""
    rng = np.random.default_rng(seed)
    n, redundant = int(rng.integers(1, 3)), int(rng.integers(1, 3))
    m = n + redundant
    lower, upper = -rng.uniform(0.1, 2, m) + 0.5, rng.uniform(0.1, 2, m) + 0.5
    wanted = Polytope.box(lower, upper)
    if seed % 3 == 1:
        free = int(rng.integers(m))
        lower[free], upper[free] = -np.inf, np.inf
        wanted = Polytope.box(lower, upper)
    if seed % 3 == 2:
        rows = rng.normal(size=(2, m))
        middle = rows @ (lower + upper) / 2
        wanted = Polytope(
            np.vstack([wanted.rows, rows]), np.append(lower, middle - 0.5), np.append(upper, middle + 0.4)
        )
    return LinearSystem(np.eye(n) / 2, rng.normal(size=(n, m)), sampling_time=0.1), wanted


CASES: dict[str, tuple[LinearSystem, Polytope]] = {
    "small_second": (ONE_STATE, Polytope.box([-1.0, -0.2], [1.0, 0.2])),
    "polygon": (ONE_STATE, regular_polygon(8)),
    "not_around_zero": (ONE_STATE, Polytope.box([0.5, -3.0], [1.0, -0.1])),
    "two_states": (TWO_STATES, Polytope.box([-1.0, -0.5, -0.3, -2.0], np.ones(4))),
    "three_for_one": (THREE_FOR_ONE, Polytope.box([-1.0, -1.0, 0.5], [0.2, 1.0, 3.0])),
    "dependent_rows": (
        ONE_STATE,
        Polytope(np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [2.0, 2.0]]), -np.ones(4), np.array([1, 1, 1, 1.5])),
    ),
    **{f"random_{seed}": random_case(seed) for seed in range(9)},
}


def least(system: LinearSystem, wanted: Polytope, count: int) -> np.ndarray:
    """Smallest inputs of all, (count, m), that push as inputs in and around U do."""
    rng, middle = np.random.default_rng(7), (wanted.lower + wanted.upper) / 2
    values = middle + (wanted.upper - wanted.lower) * rng.uniform(-0.9, 0.9, (count, len(middle)))
    pushes = np.linalg.lstsq(wanted.rows, values.T)[0].T @ system.B.T
    return pushes @ np.linalg.pinv(system.B).T


def excess(system: LinearSystem, wanted: Polytope, u: np.ndarray) -> float:
    """By how much U has to be widened, at the least, to hold an input that pushes as u does: a linear program."""
    H, h = wanted.inequalities
    n, m = system.B.shape
    program = linprog(
        np.append(np.zeros(m), 1.0),
        A_ub=np.column_stack([H, -np.ones(len(H))]),
        b_ub=h,
        A_eq=np.column_stack([system.B, np.zeros(n)]),
        b_eq=system.B @ u,
        bounds=[(None, None)] * m + [(-10.0, None)],
    )
    return float(program.fun)
