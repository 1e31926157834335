"""Flat trajectories of python-control as polynomial pieces. It is not imported: what has its attributes will do."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from trackably.arrays import Array
from trackably.systems.signals.pieces import Beyond, PolynomialPieces

_DEFAULT_END = 1.0  # of a basis of python-control [s]
_MISSED = 1e-9  # of the largest value: more is no rounding


def is_flat_trajectory(given: Any) -> bool:
    """Return whether something is like a `control.flatsys.SystemTrajectory`."""
    return all(hasattr(given, name) for name in ("basis", "coeffs", "flaglen", "eval"))


def states_as_pieces(given: Any, beyond: Beyond, span: tuple[float, float] | None) -> list[PolynomialPieces]:
    """Return all states of a flat trajectory, from zero, or its first breakpoint, to the end of its basis.

    A basis without breakpoints whose T is the default, 1 s, does not say when a trajectory ends: the polynomials hold
    from start to end of the `span` [s] that somebody claims.

    ValueError: states are no polynomials, as of systems that are not linear, or there is no span where one is needed.
    """
    ends = np.unique(np.asarray(_ends(given.basis, span), dtype=float))
    nodes = np.cos(np.pi * np.arange(2 * given.basis.N + 1) / (2 * given.basis.N))[::-1] / 2 + 0.5
    rows = [_fitted(given, start, end, nodes) for start, end in pairwise(ends.tolist())]
    return [PolynomialPieces(ends, [row[i] for row in rows], beyond) for i in range(given.nstates)]


def _ends(basis: Any, span: tuple[float, float] | None) -> Sequence[float]:
    """Return the breakpoints [s]."""
    if hasattr(basis, "breakpoints"):
        return list(basis.breakpoints)
    end = float(getattr(basis, "T", _DEFAULT_END))
    if end != _DEFAULT_END:
        return 0.0, end
    if span is None:
        raise ValueError(
            "trajectory: python-control keeps no times, and the T of this basis is its default, 1 s: give the claim "
            "from start to end, as (0.0, 3.0), or the trajectory a basis with its last time, as PolyFamily(6, T=3.0)"
        )
    return span


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
