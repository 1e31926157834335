"""Write a function as a sum of fewer kernels, so that float64 evaluates it more accurately and faster.

A smooth kernel is nearly a polynomial in its centre: κ(t − s) = Σ_k L_k(s) κ(t − s_k) with the Lagrange polynomials L_k
of Chebyshev points s_k, up to an error that falls geometrically with their number. So

    Σ_i c_i κ(t − t_i) = Σ_k (Σ_i c_i L_k(t_i)) κ(t − s_k).

Bounds that are active for long add hundreds of kernels with large weights that cancel: the input of a chain of r
integrators is a difference of order r, whose bounds add weights of the size 1/T_s^r (T_s is the sampling time) with
alternating signs. With few points, weights are added up before kernels are evaluated and rounded. Rounding errors are
bounded by the number of kernels times the sum of |c|, and both fall.
"""

import math

import numpy as np

from trackably.arrays import Array
from trackably.gp.factors.fourier import cosines, waves_at
from trackably.gp.signal import KernelSum

_FEWEST = 64  # kernels: a sum of fewer kernels is not changed, as its rounding errors are small
_LEAST, _GROWTH = 2.0, 1.125  # points per correlation time that are tried first, and the factor to the next number
_ROUNDINGS = 8.0  # largest change of a value, in units of ε Σ_i |c_i| κ(0); the bounds of rounding errors are larger
_BEYOND = 2.0  # correlation times before the first centre and after the last at which functions are compared
_RESOLVED = 16.0  # spacings of float64: times that are closer together are rounded by a large part of their distance
_ON_NODE = 1e-200  # part of the interval: a time this close to a node counts as the node, or a division would overflow
_EPS = float(np.finfo(float).eps)

# Polynomial interpolation in Chebyshev points.
#
# L. N. Trefethen, Approximation Theory and Approximation Practice, chapters 2 and 5.


def nodes(first: float, last: float, count: int) -> Array:
    """Return the extrema of the Chebyshev polynomial of degree count − 1 on [first, last], increasing: (count,)."""
    return (first + last) / 2 - (last - first) / 2 * np.cos(np.pi * np.arange(count) / (count - 1))


def interpolation(t: Array, first: float, last: float, count: int) -> Array:
    """Return the matrix (n, count) that maps values at `nodes` to the interpolant at t, shape (n,) in [first, last].

    Uses the barycentric formula, which is stable. Absolute values in a row sum to at most 1 + (2/π) ln(count) + 0.3.
    """
    weights = np.where(np.arange(count) % 2, -1.0, 1.0)
    weights[[0, -1]] /= 2
    distances = t[:, None] - nodes(first, last, count)
    hits = np.abs(distances) < _ON_NODE * (last - first)
    distances[hits] = 1.0
    matrix = weights / distances
    hit = np.any(hits, axis=1)
    matrix[hit] = hits[hit]
    return np.asarray(matrix / matrix.sum(axis=1, keepdims=True))


def compact(signal: KernelSum) -> KernelSum:
    """Return the function as a sum of at most half as many kernels, or unchanged if so few do not suffice.

    Few kernels suffice if values change by at most a few roundings of Σ_i |c_i| κ(0), an error that the given sum may
    have, too. Values are compared at many times, which is no proof. Later proofs are about the returned function.
    """
    centres, kernel = signal.centres, signal.kernel
    if len(centres) < _FEWEST or not kernel.is_analytic or not np.ptp(centres):
        return signal
    first, last, around = np.min(centres), np.max(centres), _BEYOND * kernel.correlation_time
    times = nodes(first - around, last + around, 2 * len(centres))
    values, size = signal(times), float(np.sum(np.abs(signal.weights)) * kernel(np.zeros(())))
    most = len(centres) // 2
    count = max(_FEWEST // 4, math.ceil(min(_LEAST * (last - first) / kernel.correlation_time, most + 1.0)))
    while count <= most:
        weights = signal.weights @ interpolation(centres, first, last, count)
        found = KernelSum(kernel, signal.mean, nodes(first, last, count), weights)
        if float(np.max(np.abs(found(times) - values))) <= _ROUNDINGS * _EPS * size:
            return found
        count = math.ceil(_GROWTH * count)
    return signal


def within_a_period(signal: KernelSum) -> KernelSum:
    """Return the function as a sum of kernels within one period, or unchanged if that is not half as many at most.

    A periodic kernel is a sum of m cosines and sines. So κ(t − s) is interpolated exactly in s from m equidistant times
    s_j of a period. Their rounding does no harm, because the weights solve equations for the rounded s_j. Whole periods
    are subtracted from times without rounding errors.
    """
    kernel, centres = signal.kernel, signal.centres
    if len(centres) < _FEWEST or not (period := kernel.period):
        return signal
    lines = cosines(kernel.value_and_gradient, period, period / 2, period, len(centres) // 2)
    if lines is None or period < _RESOLVED * lines.waves * np.spacing(np.max(np.abs(centres))):
        return signal
    times = np.asarray(centres[0] + period / lines.waves * np.arange(lines.waves))
    here, there = (waves_at(at, period, lines.waves) for at in (times, centres))
    return KernelSum(kernel, signal.mean, times, np.asarray(np.linalg.solve(here, there @ signal.weights)))
