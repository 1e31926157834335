"""The point of a polyhedron that is nearest to another one."""

import numpy as np

from trackably.arrays import Array
from trackably.gp.bounded.least_squares import nonnegative_least_squares

_GAP = 1e-9
"""A point is taken if it misses its rows, and the least distance, by no more than this part of the distance."""

_CONTRADICTION = 1e-14


def nearest_in(rows: Array, limits: Array, aim: Array) -> Array | None:
    """Return argmin ‖q − aim‖ with rows q ≤ limits, for rows (r, d) and aim (d,): shape (d,).

    None where the rows contradict each other. Its multipliers λ ≥ 0 with q = aim − rowsᵀ λ are found by an active-set
    method, from those u ≥ 0 that minimise ‖rowsᵀ u‖² + (1 − uᵀ excess)² (Lawson and Hanson 1974: Solving Least Squares
    Problems, chapter 23). Raises LinAlgError where they are not found in float64.
    """
    sizes = np.linalg.norm(rows, axis=1)
    sizes = np.where(sizes > 0, sizes, 1.0)
    rows, excess = rows / sizes[:, None], (rows @ aim - limits) / sizes
    unit = np.max(excess, initial=0.0)
    if not unit > 0:
        return aim
    excess = excess / unit
    u = nonnegative_least_squares(np.vstack([rows.T, excess]), np.append(np.zeros(len(aim)), 1.0))
    left = 1 - u @ excess
    if left <= _CONTRADICTION:
        return None
    multipliers = u / left
    move = -rows.T @ multipliers
    broken, squared = rows @ move + excess, move @ move
    if np.max(broken) > _GAP or abs(multipliers @ broken) > _GAP * squared:
        raise np.linalg.LinAlgError("the multipliers are not accurate")
    return np.asarray(aim + unit * move)
