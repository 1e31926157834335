"""Polynomial interpolation of smooth functions on an interval, in Chebyshev points.

L. N. Trefethen, Approximation Theory and Approximation Practice, chapters 2, 3 and 5.
"""

import numpy as np
from scipy import fft

from trackable.arrays import Array

_HIT = 1e-200  # of the interval: nearer to a node a division would overflow


def nodes(first: float, last: float, count: int) -> Array:
    """The extrema of the Chebyshev polynomial of degree count − 1 on [first, last], rising: shape (count,)."""
    return (first + last) / 2 - (last - first) / 2 * np.cos(np.pi * np.arange(count) / (count - 1))


def coefficients(values: Array) -> Array:
    """Of the interpolants of values at `nodes`, shape (…, count), in Chebyshev polynomials: the same shape."""
    scaled = fft.dct(values[..., ::-1], type=1) / (values.shape[-1] - 1)
    scaled[..., [0, -1]] /= 2
    return np.asarray(scaled)


def interpolation(t: Array, first: float, last: float, count: int) -> Array:
    """What takes values at `nodes` to those of their interpolant at t, shape (n,) in [first, last]: shape (n, count).

    The barycentric formula: stable, and absolute values in a row sum to no more than 1 + (2/π) ln(count) + 0.3.
    """
    weights = np.where(np.arange(count) % 2, -1.0, 1.0)
    weights[[0, -1]] /= 2
    distances = t[:, None] - nodes(first, last, count)
    hits = np.abs(distances) < _HIT * (last - first)
    distances[hits] = 1.0
    matrix = weights / distances
    hit = np.any(hits, axis=1)
    matrix[hit] = hits[hit]
    return np.asarray(matrix / matrix.sum(axis=1, keepdims=True))
