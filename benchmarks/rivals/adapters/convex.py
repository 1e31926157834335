"""Convex programs, written in cvxpy and solved by CLARABEL with its own tolerances. A rival's time includes both."""

import warnings
from collections.abc import Sequence

import cvxpy as cp

from benchmarks.rivals.model import NotFound

_SOLVED = (cp.OPTIMAL, cp.OPTIMAL_INACCURATE)
_INFEASIBLE = (cp.INFEASIBLE, cp.INFEASIBLE_INACCURATE)


def minimised(cost: cp.Expression, constraints: Sequence[cp.Constraint]) -> float | NotFound:
    """Return the minimum; variables and multipliers keep their values. NotFound: nothing is admissible, or it fails."""
    program = cp.Problem(cp.Minimize(cost), list(constraints))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of solutions that are nearly as accurate as asked for
            program.solve(solver=cp.CLARABEL, max_threads=1)
    except cp.SolverError as why:
        return NotFound("failed", str(why))
    if program.status in _SOLVED:
        return float(program.value)
    return NotFound("infeasible" if program.status in _INFEASIBLE else "failed", f"CLARABEL says {program.status}")
