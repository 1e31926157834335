"""Array types of the project: float64 and bool arrays of any shape, and what NumPy makes arrays of, such as lists."""

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]
ArrayLike = npt.ArrayLike


def subdivide(ends: Array, parts: ArrayLike) -> Array:
    """Divide each of the K intervals between K + 1 increasing `ends` into equal parts; return the ends of all parts.

    `parts` is the number of parts of an interval: one number for all intervals, or shape (K,).
    """
    counts = np.broadcast_to(parts, len(ends) - 1)
    inner = [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(ends[:-1], ends[1:], counts, strict=True)]
    return np.concatenate([*inner, ends[-1:]])


def root_mean_square(values: ArrayLike) -> float:
    """Return √(mean of squares) of all values."""
    return float(np.sqrt(np.mean(np.square(values))))
