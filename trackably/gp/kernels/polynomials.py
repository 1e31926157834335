"""Polynomials at arrays of times, without an array for each operation."""

from collections.abc import Sequence

import numpy as np

from trackably.arrays import Array


def horner(coefficients: Sequence[float], x: Array) -> Array:
    """Return Σ_k c_k xᵏ by Horner's rule: the shape of x."""
    found = np.full(x.shape, coefficients[-1])
    for coefficient in reversed(coefficients[:-1]):
        found *= x
        found += coefficient
    return found


def powers(x: Array, first: int, last: int) -> dict[int, Array]:
    """Return xⁿ for n = first … last (first ≥ 1), each from the one before by one multiplication."""
    power = x
    for _ in range(first - 1):
        power = power * x
    found = {first: power}
    for n in range(first + 1, last + 1):
        found[n] = found[n - 1] * x
    return found
