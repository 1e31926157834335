"""How fast the error decays under a feedback, and how far disturbances take it, in float64."""

import numpy as np

from trackably.arrays import Array
from trackably.systems.disturbance.sets import DisturbanceSet
from trackably.systems.linear import LinearSystem

LONGEST = 4000
"""So many steps are looked at; an error that needs more to decay counts as one that does not."""

_DECAYED = 1e-7


class NoInvariantSetError(ValueError):
    """Under this feedback the error does not decay, or so slowly that no invariant set is computed."""


def closed_loop(system: LinearSystem, feedback: Array) -> Array:
    """Return A_K = A + B K in float64, shape (n, n)."""
    return np.asarray(system.A + system.B @ feedback)


def errors_reach(A_K: Array, disturbance: DisturbanceSet, rows: Array, scales: Array) -> Array:
    """Return Σ_{i≥0} h_W((A_Kⁱ)ᵀ row) for rows (r, n), in float64: shape (r,). It is zero for W = {0}.

    Terms are left out once a row, in units of the states' `scales` (n,), has fallen below 1e-7 of its largest size.
    Raises NoInvariantSetError where that takes too long, or never happens.
    """
    total, largest, powers = np.zeros(len(rows)), np.zeros(len(rows)), rows
    if not len(rows):
        return total
    if not spectral_radius(A_K) < 1:
        raise NoInvariantSetError(
            "feedback: the eigenvalues of A + B K must lie inside the unit circle, but one has the size "
            f"{spectral_radius(A_K):.6g}"
        )
    for _ in range(LONGEST):
        total = total + disturbance.support(powers)
        size = np.max(np.abs(powers) * scales, axis=1)
        largest = np.maximum(largest, size)
        if np.all(size <= _DECAYED * largest):
            return total
        powers = powers @ A_K
    raise too_slow(A_K)


def too_slow(A_K: Array) -> NoInvariantSetError:
    """Return the error to raise where the error of the loop decays too slowly."""
    return NoInvariantSetError(
        f"feedback: the error decays too slowly under A + B K, which has an eigenvalue of size "
        f"{spectral_radius(A_K):.6g}"
    )


def spectral_radius(A_K: Array) -> float:
    """Return the size of the largest eigenvalue."""
    return float(np.max(np.abs(np.linalg.eigvals(A_K))))
