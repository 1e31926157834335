"""Vectors of rationals over one denominator, and roundings to float64 in a known direction."""

import math
from collections.abc import Iterable, Sequence
from fractions import Fraction
from itertools import chain
from typing import cast

import numpy as np

from trackably.arguments import numbers
from trackably.arrays import Array, ArrayLike

Vector = tuple[Fraction, ...]


def vectors(what: str, given: ArrayLike | Sequence[Sequence[Fraction]]) -> tuple[Vector, ...]:
    """Return the rows of a matrix as rationals. Fractions are kept, and float64 numbers are taken as they are.

    ValueError: it is no matrix, or holds a number that is not finite. TypeError: it holds something else.
    """
    array = numbers(what, cast(ArrayLike, given))
    if array.ndim != 2 or not array.shape[1]:
        raise ValueError(f"{what} must be a matrix with a column for each state, got shape {array.shape}")
    if not np.all(np.isfinite(array)):
        raise ValueError(f"{what} must be finite, got {array.tolist()}")
    rows = given if isinstance(given, list | tuple) else array.tolist()
    return tuple(tuple(Fraction(value) for value in row) for row in rows)


def as_array(rows: Sequence[Vector], dimension: int) -> Array:
    """Return rationals as float64, shape (rows, dimension)."""
    return np.array([[float(value) for value in row] for row in rows]).reshape(len(rows), dimension)


def printed(rows: Sequence[Vector]) -> list[list[float]]:
    """Return rationals as the nearest float64 numbers, for people."""
    return [[float(value) for value in row] for row in rows]


def common_denominator(numbers: Iterable[Fraction]) -> int:
    """Return the least number that makes all of them whole."""
    return math.lcm(*(number.denominator for number in numbers))


def whole(rows: Sequence[Sequence[Fraction]]) -> tuple[int, list[list[int]]]:
    """Return d and the whole numbers d · rows."""
    d = common_denominator(chain.from_iterable(rows))
    return d, [[int(value * d) for value in row] for row in rows]


def float_above(number: Fraction) -> float:
    """Return a float64 ≥ `number`, the smallest or the one next to it."""
    nearest = float(number)
    return nearest if Fraction(nearest) >= number else math.nextafter(nearest, math.inf)


def float_below(number: Fraction) -> float:
    """Return a float64 ≤ `number`, the largest or the one next to it."""
    return -float_above(-number)
