"""Linear algebra in rational numbers: arrays of `Fraction`, to which float64 numbers are converted exactly."""

from collections.abc import Sequence
from fractions import Fraction
from math import inf, nextafter
from sys import float_info

import numpy as np
import numpy.typing as npt

from trackably.checker import redundancy

Rationals = npt.NDArray[np.object_]
ExactLike = npt.ArrayLike | Sequence[Fraction] | Sequence[Sequence[Fraction]]
"""What `exact` makes rationals of: float64 numbers or rationals, in lists or arrays."""


def exact(numbers: ExactLike) -> Rationals:
    """Convert float64 numbers to rationals, exactly; rationals are unchanged."""
    array = np.asarray(numbers, dtype=object)
    return np.array([Fraction(v) for v in array.ravel().tolist()], dtype=object).reshape(array.shape)


def row_echelon(matrix: Rationals) -> tuple[Rationals, list[int]]:
    """Return the reduced row echelon form of a matrix, and the indices of its pivot columns."""
    rows, pivots = redundancy.row_echelon(matrix.tolist(), matrix.shape[1])
    return np.array(rows, dtype=object).reshape(matrix.shape), pivots


def inverse(matrix: Rationals) -> Rationals:
    """Return the inverse of a square matrix, exactly. ZeroDivisionError: the matrix is singular."""
    n = len(matrix)
    rows, pivots = row_echelon(np.hstack([matrix, exact(np.eye(n))]))
    if pivots != list(range(n)):
        raise ZeroDivisionError(f"inverse: expected an invertible matrix, got a singular one of shape {matrix.shape}")
    return rows[:, n:]


def null_space(matrix: Rationals) -> Rationals:
    """Return a basis of {v : M v = 0}, one vector in each column."""
    n = matrix.shape[1]
    return np.array(redundancy.null_space(matrix.tolist(), n), dtype=object).reshape(-1, n).T


def float_above(number: Fraction) -> float:
    """Return a float64 ≥ `number`: the smallest one, or the one after it; infinity if none is finite."""
    try:
        nearest = float(number)
    except OverflowError:
        return inf if number > 0 else -float_info.max
    return nearest if Fraction(nearest) >= number else nextafter(nearest, inf)


def float_below(number: Fraction) -> float:
    """Return a float64 ≤ `number`: the largest one, or the one before it; −∞ if none is finite."""
    return -float_above(-number)
