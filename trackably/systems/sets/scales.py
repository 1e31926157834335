"""Scales that a set gives its coordinates: divided by them, a problem has the same numbers in whatever units."""

import numpy as np

from trackably.arrays import Array
from trackably.systems.sets.polytope import Polytope


def extents(bounded: Polytope) -> Array:
    """Return how far each coordinate may move while the others stand still, shape (n,); infinite without bounds."""
    sizes = np.abs(bounded.rows)
    reach = np.divide(bounded.widths[:, None], sizes, out=np.full_like(sizes, np.inf), where=sizes > 0)
    return np.asarray(np.min(reach, axis=0, initial=np.inf))


def unit_scales(bounded: Polytope) -> Array:
    """Return a unit for each coordinate (n,): its extent, and 1 where nothing bounds it."""
    reach = extents(bounded)
    return np.where(np.isfinite(reach), reach, 1.0)


def squares_in_widths(bounded: Polytope) -> Array:
    """Return Σ (row / width)² as a matrix (n, n): a cost of errors as parts of widths; zero where no row bounds."""
    rows = bounded.rows / bounded.widths[:, None]
    return np.asarray(rows.T @ rows)
