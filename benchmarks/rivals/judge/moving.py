"""Curves of systems that are driven by accelerations, as positions that are piecewise polynomials of real time.

Rivals that know no sampled systems are judged as they see the system: x = (p, ṗ), u = p̈ at all times.
"""

from collections.abc import Callable, Sequence
from fractions import Fraction

import numpy as np

from benchmarks.rivals.judge.curves import PolynomialCurve
from benchmarks.rivals.judge.polynomials import Combination, Pieces
from benchmarks.rivals.model import Problem
from trackably.arrays import Array


def is_driven_by_accelerations(problem: Problem) -> bool:
    """Whether the system is ṗ = v, v̇ = u with as many inputs as positions."""
    if problem.continuous is None:
        return False
    A, B = problem.continuous
    m = B.shape[1]
    zero, one = np.zeros((m, m)), np.eye(m)
    return np.array_equal(A, np.block([[zero, one], [zero, zero]])) and np.array_equal(B, np.vstack([zero, one]))


def moving(positions: Sequence[Pieces], problem: Problem) -> PolynomialCurve:
    """Return the curve of these positions, with everything that is bounded."""
    speeds = [p.derivative() for p in positions]
    accelerations = [v.derivative() for v in speeds]
    of = {"state": [*positions, *speeds], "input": accelerations}
    bounded = tuple(
        (
            limit.name,
            limit.bounds,
            Combination(tuple((w, p) for w, p in zip(limit.row, of[limit.side], strict=True) if w)),
        )
        for limit in problem.task.plant.given_constraints
    )
    return PolynomialCurve(tuple(positions), bounded)


def interpolated(function: Callable[[float], float], breaks: Array, degree: int) -> Pieces:
    """Return the polynomials of this degree that a function is between its breaks, up to rounding in float64."""
    nodes = (1 - np.cos(np.pi * np.arange(degree + 1) / degree)) / 2
    powers = np.vander(nodes, increasing=True)
    parts = []
    for start, end in zip(breaks[:-1].tolist(), breaks[1:].tolist(), strict=True):
        values = [function(start + (end - start) * node) for node in nodes.tolist()]
        scaled, length = np.linalg.solve(powers, values), Fraction(end) - Fraction(start)
        parts.append(tuple(Fraction(c) / length**k for k, c in enumerate(scaled.tolist())))
    return Pieces(tuple(map(Fraction, breaks.tolist())), tuple(parts))
