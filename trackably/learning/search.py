"""Search for the solution of a problem, constrained or not: choose starts, and restore feasibility if needed.

A place is a time at which a program imposes a bound.
"""

from collections.abc import Sequence

import numpy as np

from trackably.arrays import Array
from trackably.learning.exchange import Exchange
from trackably.learning.problem import ConstrainedProblem, NoSolution, Solution
from trackably.learning.screening import can_screen, screen

_FEWEST_BASINS = 16  # least number of starts that are searched if all kernels are periodic
_SPREAD_THINLY = 256  # points of the whole search space that are tried if no other search finds a feasible one


def best_solution(
    problem: ConstrainedProblem, near: Solution | None = None, free: Solution | None = None
) -> Solution | NoSolution:
    """Return the best local minimum that satisfies every bound on its whole index set, or the reason why there is none.

    Deterministic. The likelihood of periodic kernels has a basin for nearly every period: the most promising basins are
    searched one by one. For other kernels, the searches from the starts of the search space impose bounds at the same
    times. `near`, the solution of a problem with fewer or slightly different constraints, is one more start. `free` is
    the solution without constraints, if it is known: it is then not searched again. ValueError: the problem has
    required values, which a posterior mean cannot meet.
    """
    if problem.required:
        raise ValueError(
            "required: expected no given values, as hyperparameters alone cannot meet them, got "
            f"{len(problem.required)}; learn the function too"
        )
    exchange = Exchange(problem)
    if can_screen(problem.prior):
        if free and len(problem.prior.parts) > 1:  # screening of several signals ignores bounds: it is not repeated
            starts = [*_point(free), *free.others]
        else:
            starts = screen(problem, max(_FEWEST_BASINS, problem.space.starts))
        exchange.follow([*_point(near), *starts])
    if exchange.best is None:
        _from_spread_starts(exchange, near, free)
    return exchange.outcome


def solution_from(
    starts: Sequence[Array], problem: ConstrainedProblem, ceiling: float = np.inf
) -> Solution | NoSolution:
    """Return the best local minimum found from these ln θ, each of shape (p,), with l below the `ceiling`.

    A search ends when the minimum of its relaxed program is not below the ceiling.
    """
    exchange = Exchange(problem, ceiling)
    exchange.together(starts)
    return exchange.outcome


def continued(solution: Solution, problem: ConstrainedProblem) -> Solution | NoSolution:
    """Solve a problem whose bounds differ slightly from those of `solution`, starting at its minimiser.

    If this finds no feasible point, search from all starts.
    """
    exchange = Exchange(problem, active=solution.active)
    exchange.together(_point(solution))
    return best_solution(problem, near=solution) if exchange.best is None else exchange.outcome


def _from_spread_starts(exchange: Exchange, near: Solution | None, free: Solution | None) -> None:
    """Search from the starts of the search space; if these searches find no feasible point, restore feasibility.

    If `free` is not known, a few starts, as many as there are hyperparameters, are first searched without bounds, to
    find the times at which results violate bounds. All starts are then searched with bounds at these times, which may
    lead to other minima. If the prior mean is an equilibrium inside the bounds, scaling the signal down towards it
    gives a feasible point, which is kept and improved. Otherwise the violation is minimised first.
    """
    space = exchange.problem.space
    starts = list(space.start_points())
    exchange.active = near.active if near else ()
    known = len(starts) if free else len(space.bounds)  # number of first starts, searched without bounds
    exchange.together([*_point(near), *([*_point(free), *free.others] if free else starts[:known])])
    others = starts if any(map(len, exchange.active)) else starts[known:]
    if exchange.best is None:
        exchange.keep_scaled_down(starts)
        others = [*_best(exchange), *others]
    exchange.together(others)
    if exchange.closest is None:
        return
    if exchange.best is None:
        exchange.restore(starts)
        exchange.together(_best(exchange) or [exchange.closest.log_theta])
    if exchange.best is None:  # the last resort is to try points of the whole space
        for point in space.points(_SPREAD_THINLY):
            exchange.try_point(point)
        exchange.restore([exchange.closest.log_theta])
        exchange.together(_best(exchange) or [exchange.closest.log_theta])


def _best(exchange: Exchange) -> list[Array]:
    return [exchange.best.log_theta] if exchange.best else []


def _point(near: Solution | None) -> list[Array]:
    return [near.posterior.prior.log_hyperparameters] if near else []
