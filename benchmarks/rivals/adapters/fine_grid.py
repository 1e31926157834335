"""The same program with its bounds on a fine grid of times, by CLARABEL, at the likeliest hyperparameters.

g = m⁺ + Σ_a λ_a κ⁺(·, L_a) with the least ‖g − m⁺‖ in the posterior's space such that lower ≤ L_a g ≤ upper for all
rows a of the grid. With K⁺ = F Fᵀ and v = Fᵀ λ it is the program of the least |v|² with the rows in their bounds.
"""

from benchmarks.rivals.adapters.convex import shortest
from benchmarks.rivals.adapters.rows import POINTS, Grid, evenly, root
from benchmarks.rivals.curves import curve_of
from benchmarks.rivals.model import Found, Problem
from trackably.gp.row_posterior import RowPosterior


def solve(problem: Problem, points: int = POINTS) -> Found:
    """Ask for the bounds at as many times, evenly over the window."""
    grid = Grid.of(problem, evenly(problem, points))
    posterior = problem.likeliest.posterior
    given = RowPosterior(posterior, grid.rows)
    found = shortest(root(given.covariance), grid.lower - given.mean, grid.upper - given.mean)
    curve = curve_of(given.signals(found.multipliers / 2), problem)
    objective = posterior.negative_log_marginal_likelihood()[0] + found.square
    return Found(curve, objective, "J at the likeliest θ", points, posterior.prior)
