"""A root of a covariance: from independent standard normal numbers to values with this covariance."""

import numpy as np

from trackably.arrays import Array

_NEGLIGIBLE = 1e-12  # of the largest eigenvalue: covariances of smooth processes are known no better


def root(covariance: Array) -> Array:
    """Return F (n, r) with F Fᵀ = Σ, up to 1e-12 n of each variance, for a covariance Σ (n, n) of any rank.

    F has few columns where the values depend on each other, as those of a smooth process at close times do. Rows are
    scaled to the same variance before, so that their units do not matter.
    """
    std = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    scale = np.where(std > 0, std, np.inf)
    values, vectors = np.linalg.eigh(covariance / scale / scale[:, None])
    kept = values > _NEGLIGIBLE * values[-1]
    return np.asarray(std[:, None] * vectors[:, kept] * np.sqrt(values[kept]))
