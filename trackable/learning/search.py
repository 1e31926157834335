"""The one route to a solution, constrained or not: from which starts, and what is tried where nothing is feasible."""

from dataclasses import replace

from trackable.arrays import Array
from trackable.learning.candidate import Candidate
from trackable.learning.exchange import Exchange
from trackable.learning.nonlinear import Program
from trackable.learning.problem import ConstrainedProblem, NoSolution, Solution
from trackable.learning.screening import can_screen, screened

_FEWEST_BASINS = 16
_SPREAD_THINLY = 256


def best_solution(problem: ConstrainedProblem, near: Solution | None = None) -> Solution | NoSolution:
    """Return the best local minimum that keeps every bound on its whole index set, or why there is none. Deterministic.

    The likelihood of periodic kernels has a basin for nearly every period: the most promising ones are searched one by
    one. Other kernels are searched from the starts of the search space, which share what they learn of the constraints.
    `near` is the solution of a problem with fewer or slightly different constraints: it is a start too.
    """
    exchange = Exchange(problem)
    if can_screen(problem.prior):
        for start in [*_point(near), *screened(problem, max(_FEWEST_BASINS, problem.space.starts))]:
            exchange.follow(start)
    if exchange.best is None:
        _from_spread_starts(exchange, near)
    return exchange.outcome


def tightened(solution: Solution, problem: ConstrainedProblem) -> Solution | NoSolution:
    """Solve a problem that only adds constraints to the one that `solution` solves.

    Where the old minimiser keeps the new bounds too it is the new minimiser: nothing is left to do.
    """
    if Candidate.at(problem, *_point(solution)).everywhere(problem).is_feasible:
        return replace(solution, fits=0)
    return best_solution(problem, near=solution)


def continued(solution: Solution, problem: ConstrainedProblem) -> Solution | NoSolution:
    """Solve a problem whose bounds are those of `solution`'s, moved a little: its minimiser leads to the new one.

    Where that is lost on the way, all starts are tried again.
    """
    exchange = Exchange(problem, active=solution.active)
    exchange.together(_point(solution))
    return best_solution(problem, near=solution) if exchange.best is None else exchange.outcome


def _from_spread_starts(exchange: Exchange, near: Solution | None) -> None:
    """Search from the starts of the search space, for a point that keeps all bounds too.

    Where the prior mean is an equilibrium inside the bounds, a feasible point is found by letting the signal fade
    towards it; it is kept in hand and improved. Elsewhere the violation is minimised first.
    """
    space = exchange.problem.space
    starts = list(space.start_points())
    exchange.active = near.active if near else ()
    exchange.together([*_point(near), *starts])
    if exchange.best is None:
        exchange.keep_faded(starts)
    if any(places.size for places in exchange.active):
        # What the first sweep learned about the constraints may lead the same starts to better minima.
        exchange.together([*_best(exchange), *starts])
    if exchange.closest is None:
        return
    if exchange.best is None:
        exchange.together(starts, Program.minimise_violation)
        exchange.together(_best(exchange) or [exchange.closest.log_theta])
    if exchange.best is None:  # the last resort: points of the whole space
        exchange.try_all(space.points(_SPREAD_THINLY))
        exchange.together([exchange.closest.log_theta], Program.minimise_violation)
        exchange.together(_best(exchange) or [exchange.closest.log_theta])


def _best(exchange: Exchange) -> list[Array]:
    return [exchange.best.log_theta] if exchange.best else []


def _point(near: Solution | None) -> list[Array]:
    return [near.posterior.prior.log_hyperparameters] if near else []
