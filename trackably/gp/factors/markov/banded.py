"""Symmetric band matrices, by their diagonals: row q holds the q-th one below the main one, then q zeros."""

import numpy as np
import scipy

from trackably.arrays import Array
from trackably.gp.factors.markov.differences import Numbers


def plus(wider: Numbers, narrower: Numbers) -> Numbers:
    """Return the sum of two band matrices."""
    found = wider.astype(np.result_type(wider, narrower))
    found[: len(narrower)] += narrower
    return found


def congruent(lower: Numbers, diagonal: Array) -> Numbers:
    """Return L V Lᵀ for a `lower` triangular band matrix L and a `diagonal` matrix V (n,)."""
    order, n = len(lower) - 1, len(diagonal)
    found = np.zeros_like(lower)
    for q in range(order + 1):
        for lag in range(order + 1 - q):
            count = n - q - lag
            found[q, lag : n - q] += lower[q + lag, :count] * lower[lag, :count] * diagonal[:count]
    return found


def times_vector(matrix: Numbers, x: Numbers) -> Numbers:
    """Return B x for x (n,)."""
    found: Numbers = matrix[0] * x
    for q, beside in enumerate(matrix[1:], 1):
        found[q:] += beside[:-q] * x[:-q]
        found[:-q] += beside[:-q] * x[q:]
    return found


def condition(matrix: Array, factor: Array) -> float:
    """Return about ‖B‖₁ ‖B⁻¹‖₁ for B with its diagonal scaled to ones, given its Cholesky `factor`.

    It is at most that. W. W. Hager: Condition estimates. SIAM J. Sci. Stat. Comput. 5 (1984), 311–316.
    """
    n, scale = matrix.shape[1], np.sqrt(matrix[0])

    def solved(x: Array) -> Array:
        found, _ = scipy.linalg.lapack.dpbtrs(factor, (scale * x)[:, None], lower=True)
        return np.asarray(scale * found[:, 0])

    first = solved(np.full(n, 1 / n))
    worst = np.zeros(n)
    worst[np.argmax(np.abs(solved(np.where(first < 0, -1.0, 1.0))))] = 1.0
    inverse = max(np.abs(first).sum(), np.abs(solved(worst)).sum())
    beside = [np.max(np.abs(row[:-q]) / (scale[q:] * scale[:-q])) for q, row in enumerate(matrix[1:], 1)]
    return float((1 + 2 * sum(beside)) * inverse)


def log_determinant_slope(matrix: Numbers, step: float) -> float:
    """Return ∂ ln|B| from B + i `step` ∂B: the imaginary parts of the pivots, as their squares are lost in rounding."""
    order, n = len(matrix) - 1, matrix.shape[1]
    entries = np.zeros((3 * order + 1, n), dtype=complex, order="F")  # `order` rows more than entries, for the pivoting
    entries[2 * order] = matrix[0]
    for q, row in enumerate(matrix[1:], 1):
        entries[2 * order + q, : n - q] = entries[2 * order - q, q:] = row[: n - q]
    factors, _, _ = scipy.linalg.lapack.zgbtrf(entries, order, order, overwrite_ab=True)
    pivots = factors[2 * order]
    return float(np.sum(pivots.imag / pivots.real) / step)
