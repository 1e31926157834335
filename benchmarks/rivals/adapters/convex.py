"""Convex programs, written in cvxpy and solved by CLARABEL with its own tolerances. A rival's time includes both."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import cvxpy as cp
import numpy as np

from benchmarks.rivals.model import NotFound
from trackably.arrays import Array

_SOLVED = (cp.OPTIMAL, cp.OPTIMAL_INACCURATE)
_INFEASIBLE = (cp.INFEASIBLE, cp.INFEASIBLE_INACCURATE)


def minimised(cost: cp.Expression, constraints: Sequence[cp.Constraint]) -> float:
    """Return the minimum; variables and multipliers keep their values. NotFound: nothing is admissible, or it fails."""
    program = cp.Problem(cp.Minimize(cost), list(constraints))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of solutions that are nearly as accurate as asked for
            program.solve(solver=cp.CLARABEL, max_threads=1)
    except cp.SolverError as why:
        raise NotFound("failed", str(why)) from why
    if program.status not in _SOLVED:
        kind = "infeasible" if program.status in _INFEASIBLE else "failed"
        raise NotFound(kind, f"CLARABEL says {program.status}")
    return float(program.value)


@dataclass(frozen=True)
class Shortest:
    """The w of least norm with lower ≤ F w ≤ upper, its |w|², and multipliers: positive where the lower bound holds."""

    w: Array
    square: float
    multipliers: Array


def shortest(F: Array, lower: Array, upper: Array) -> Shortest:
    """Solve with one inequality out of sixteen first, and add those that are broken until none is.

    Most bounds of a grid hold back nothing. Programs with fewer bounds are relaxations, so that what the last one says
    holds of the whole; and what is infeasible is seen more clearly: rows of close times nearly depend on each other.
    """
    G, h = np.vstack([F, -F]), np.concatenate([upper, -lower])
    chosen = np.arange(len(G)) % 16 == 0
    while True:
        w = cp.Variable(F.shape[1])
        kept = G[chosen] @ w <= h[chosen]
        square = minimised(cp.sum_squares(w), [kept])
        broken = ~chosen & (G @ w.value > h)
        if not np.any(broken):
            multipliers = np.zeros(len(G))
            multipliers[chosen] = kept.dual_value
            above, below = np.split(multipliers, 2)
            return Shortest(w.value, square, below - above)
        chosen |= broken
