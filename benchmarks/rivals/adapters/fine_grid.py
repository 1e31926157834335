"""The same program with its bounds on a fine grid of times, by CLARABEL, at the likeliest hyperparameters.

g = m⁺ + Σ_a λ_a κ⁺(·, L_a) with the least ‖g − m⁺‖ in the posterior's space such that lower ≤ L_a g ≤ upper for all
rows a of the grid. With K⁺ = F Fᵀ and v = Fᵀ λ it is the program of the least |v|² with the rows in their bounds.
"""

import numpy as np

from benchmarks.rivals.adapters.conic import Conic, Unsolved
from benchmarks.rivals.adapters.rows import POINTS, Grid
from benchmarks.rivals.judge import curve_of
from benchmarks.rivals.model import Answer, Found, NotFound, Problem, Promise, Rival
from trackably.gp.bounded import root
from trackably.gp.row_posterior import RowPosterior


def solve(problem: Problem, points: int = POINTS) -> Answer:
    """Ask for the bounds at as many times, evenly over the window."""
    grid = Grid.of(problem, points)
    if grid is None:
        return NotFound("does not apply", "the program is not convex: an input is no weighted sum of the signal")
    posterior = problem.likeliest.posterior
    given = RowPosterior(posterior, grid.rows)
    F = root(given.covariance)
    r = F.shape[1]
    right = np.concatenate([grid.upper - given.mean, given.mean - grid.lower])
    found = Conic(2 * np.eye(r), np.zeros(r), np.vstack([F, -F]), right).solve_by_exchange()
    if isinstance(found, Unsolved):
        return found.answer
    above, below = np.split(found.dual, 2)
    curve = curve_of(given.signals((below - above) / 2), problem)
    objective = posterior.negative_log_marginal_likelihood()[0] + found.objective
    return Found(curve, objective, "J at the likeliest θ", points, posterior.prior)


FINE_GRID = Rival(
    "b",
    f"the same program on {POINTS} times, CLARABEL",
    Promise("", "the program itself", "bounds at the times of its grid, none between"),
    solve,
    needs=("clarabel",),
    licence="Apache-2.0",
)
