"""Durbin's recursion: what a symmetric positive definite Toeplitz matrix is made of, in O(n²) time and O(n) memory.

G. H. Golub and C. F. Van Loan, Matrix Computations (4th edition), section 4.7.
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg import blas

from trackable.arrays import Array

_NEGLIGIBLE = 1e-17  # as a reflection: f₀ = 1 would not feel it


class Inverse(NamedTuple):
    """A⁻¹ e₁, shape (n,), which determines A⁻¹, and ln|A|."""

    first_column: Array
    log_determinant: float


def durbin(column: Array) -> Inverse | None:
    """From the first `column` of A, shape (n,); None where A is not positive definite in float64.

    With A_k the leading k × k part and A_k f = E_k e₁, f₀ = 1, one row more asks for

        f ← (f, 0) + ρ (0, reversed f),   ρ = −Σ_j f_j a_{k−j} / E_k,   E_{k+1} = E_k (1 − ρ²),

    and |A| is the product of all E_k. A is positive definite where every reflection ρ lies inside (−1, 1). What lies
    far apart has little to do with each other: f ends (at `last`) where all later reflections are negligible.
    """
    n, scale = len(column), float(column[0])
    if not scale > 0:
        return None
    reversed_column = column[::-1] / scale
    f, before, errors = np.zeros(n), np.zeros(n), [1.0]
    f[0], last = 1.0, 0
    for k in range(1, n):
        reflection = -blas.ddot(f, reversed_column, last + 1, 0, 1, n - 1 - k) / errors[-1]
        if not abs(reflection) < 1:
            return None
        if abs(reflection) > _NEGLIGIBLE:
            blas.dcopy(f, before, last + 1)
            blas.daxpy(before, f, last + 1, reflection, 0, -1, k - last)
            last = k
        errors.append(errors[-1] * (1 - reflection) * (1 + reflection))
    return Inverse(f / (scale * errors[-1]), float(n * np.log(scale) + np.sum(np.log(errors))))
