"""The shortest vector between bounds: where a standard normal distribution is most dense among the admissible vectors.

It is the least distance program of C. L. Lawson and R. J. Hanson, Solving Least Squares Problems (1974), chapter 23.
The non-negative u that brings Nᵀ u nearest to 0 and −gᵀ u nearest to 1 is positive for the rows that keep w from zero.
"""

import numpy as np

from trackably.arrays import Array
from trackably.gp.bounded.least_squares import nonnegative_least_squares

_HELD = 1e-9  # the distances of the program's own walls that count as zero


def least_norm(normals: Array, offsets: Array) -> Array | None:
    """Return the w of least norm with N w + g ≥ 0, for `normals` N (W, r) of length one and `offsets` g (W,).

    The result keeps all rows up to 1e-9. None: there is no such w. Only rows that would be broken enter the program.
    Raises LinAlgError where w is not found in float64.
    """
    w, walls = np.zeros(normals.shape[1]), list[int]()
    while (height := normals @ w + offsets).min(initial=0.0) < -_HELD:
        worst = int(np.argmin(height))
        if worst in walls:
            return None
        walls.append(worst)
        system, target = np.vstack([normals[walls].T, -offsets[walls]]), np.append(np.zeros(len(w)), 1.0)
        pushes = np.array(walls)[nonnegative_least_squares(system, target) > 0]
        w = np.linalg.lstsq(normals[pushes], -offsets[pushes])[0]
    return w
