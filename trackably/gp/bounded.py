"""The shortest vector that satisfies linear inequalities.

Of a standard normal distribution, it is the most likely admissible value. It solves the least distance program of
C. L. Lawson and R. J. Hanson, Solving Least Squares Problems (1974), chapter 23: for normals N and offsets g of the
bounds N w + g ≥ 0, active bounds are those with u_i > 0, for the u ≥ 0 that brings Nᵀ u nearest to 0 and −gᵀ u nearest
to 1.
"""

import numpy as np
import scipy

from trackably.arrays import Array

_HELD = 1e-9  # standard deviations: a bound that is violated by no more than this counts as satisfied


def least_norm(normals: Array, offsets: Array) -> Array | None:
    """Return the w of least norm with N w + g ≥ 0, for `normals` N (W, r) of length one and `offsets` g (W,).

    The result satisfies all rows up to 1e-9. Return None if there is no such w, or if it is not found in float64.
    """
    w: Array = np.zeros(normals.shape[1])
    if (normals @ w + offsets).min(initial=0.0) < -_HELD:
        try:
            found, _ = scipy.optimize.nnls(np.vstack([normals.T, -offsets]), np.append(w, 1.0))
            active = found > 0
            w = np.asarray(np.linalg.lstsq(normals[active], -offsets[active])[0], dtype=float)
        except (RuntimeError, np.linalg.LinAlgError):  # rounding makes the active-set method cycle
            return None
    return w if (normals @ w + offsets).min(initial=0.0) >= -_HELD else None
