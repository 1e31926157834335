"""Flat trajectories of python-control as polynomial pieces. It is not imported: what has its attributes will do."""

from itertools import pairwise
from typing import Any

import numpy as np

from trackable.arrays import Array
from trackable.systems.signals.pieces import Beyond, PolynomialPieces

_MISSED = 1e-9  # of the largest value: more is no rounding


def is_flat_trajectory(given: Any) -> bool:
    """Return whether something is like a `control.flatsys.SystemTrajectory`."""
    return all(hasattr(given, name) for name in ("basis", "coeffs", "flaglen", "eval"))


def states_as_pieces(given: Any, beyond: Beyond) -> list[PolynomialPieces]:
    """Return all states of a flat trajectory, from zero, or its first breakpoint, to the end of its basis.

    ValueError: they are no polynomials, as of systems that are not linear.
    """
    ends = np.asarray(getattr(given.basis, "breakpoints", [0.0, float(getattr(given.basis, "T", 1.0))]), dtype=float)
    ends = np.unique(ends)
    nodes = np.cos(np.pi * np.arange(2 * given.basis.N + 1) / (2 * given.basis.N))[::-1] / 2 + 0.5
    rows = [_fitted(given, start, end, nodes) for start, end in pairwise(ends.tolist())]
    return [PolynomialPieces(ends, [row[i] for row in rows], beyond) for i in range(given.nstates)]


def _fitted(given: Any, start: float, end: float, nodes: Array) -> Array:
    """Return the coefficients of each state between two times: shape (n, degree + 1)."""
    width, inside = end - start, 1e-9  # the last point of a piece belongs to the next one
    x = nodes * (1 - inside)
    values = np.asarray(given.eval(start + width * x)[0], dtype=float)
    degree = int(np.max(getattr(given.basis, "degree", given.basis.N - 1)))
    powers = np.vander(x, degree + 1, increasing=True)
    found = np.linalg.lstsq(powers, values.T, rcond=None)[0].T
    missed, size = np.max(np.abs(found @ powers.T - values)), np.max(np.abs(values))
    if not missed <= _MISSED * max(float(size), 1e-30):
        raise ValueError(f"trajectory: states are no polynomials of degree {degree}: they are {missed:.3g} off")
    return np.asarray(found / width ** np.arange(degree + 1))
