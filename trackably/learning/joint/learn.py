"""Learn hyperparameters and function together, from several starts: those of the likelihood and of θ alone."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from trackably.arrays import Array
from trackably.gp.joint import JointPosterior
from trackably.gp.posterior import IllConditioned
from trackably.learning.joint.search import JointSearch, Point
from trackably.learning.problem import (
    ConstrainedProblem,
    Contradiction,
    NoFunction,
    NoSolution,
    NothingFeasible,
    Solution,
)
from trackably.learning.search import best_solution, better_solution
from trackably.learning.search import continued as continued_alone

_OTHER_MINIMA = 3  # of the likelihood: they are starts too
_MANY_SAMPLES = 200  # the search over θ alone takes longer than that for functions
_TOLD = 4  # bounds that contradict each other


def learn_jointly(problem: ConstrainedProblem, also: Sequence[Array] = ()) -> Solution | NoSolution:
    """Return the best local minimum of J = l + D that keeps every bound at all times, or why there is none.

    Starts are the likelihood's minima, the minimum over θ alone (the paper's problem, in which D = 0), so that J is
    never larger than there, and the ln θ in `also`. Where the function can be found from no start (formulas may lead
    nowhere), the minimum over θ alone is returned: it has no active bounds. Deterministic.
    """
    free = best_solution(ConstrainedProblem(problem.samples, problem.prior, problem.space))
    if not isinstance(free, Solution):
        return free
    search = JointSearch(problem)
    search.follow(free.posterior.prior.log_hyperparameters)
    alone = _alone(replace(problem, pins=()), free, search.best)
    if isinstance(alone, Solution):
        search.follow(alone.posterior.prior.log_hyperparameters)
    for other in (*also, *free.others[:_OTHER_MINIMA]):
        if search.best is None or _nlml(problem, other) < search.best.objective:
            search.follow(other)
    fits = search.fits + sum(found.fits for found in (free, alone) if isinstance(found, Solution))
    least = search.best.objective if search.best else np.inf
    if isinstance(alone, Solution) and not problem.pins and alone.objective < least:
        return replace(alone, fits=fits, unconstrained=free.posterior, alone=alone.objective)
    if search.best is not None:
        known = alone.objective if isinstance(alone, Solution) else np.inf
        return replace(_solution(search.best, fits, free.posterior), alone=known)
    if search.closest is not None:
        return _no_solution(problem, search.closest)
    return NoFunction(problem.pins) if problem.pins or alone is None else alone


def learn_from(starts: Sequence[Array], problem: ConstrainedProblem) -> Solution | NoSolution:
    """Return the best local minimum of J = l + D from these ln θ alone, each of shape (p,), or why there is none.

    For a problem that differs little from one whose hyperparameters are known, where a search from everywhere is not
    needed. `problem.pins` are not met by hyperparameters alone: where no function is found, there is no solution.
    """
    search = JointSearch(problem)
    for log_theta in starts:
        search.follow(log_theta)
    if search.best is not None:
        return _solution(search.best, search.fits, None)
    return _no_solution(problem, search.closest) if search.closest is not None else NoFunction(problem.pins)


def continued(solution: Solution, problem: ConstrainedProblem) -> Solution | NoSolution:
    """Solve a problem whose bounds or times differ a little from those of `solution`: search from its minimiser.

    Where that finds no function, a solution of hyperparameters alone is continued as such; any other is sought anew. It
    may cost more than hyperparameters alone would: `alone` is still that of `solution`, and tells.
    """
    search = JointSearch(problem)
    places = solution.active if solution.active_bounds else None
    if solution.missed or solution.is_rough:  # hyperparameters hardly move where J does not
        search.settle(solution.posterior.prior.log_hyperparameters, places, solution.signals)
        if search.best and search.best.objective - solution.objective <= 2 * solution.allowed_gap:
            return replace(_solution(search.best, search.fits, solution.unconstrained), alone=solution.alone)
    search.follow(solution.posterior.prior.log_hyperparameters, places, solution.signals)
    if search.best:
        return replace(_solution(search.best, search.fits, solution.unconstrained), alone=solution.alone)
    if solution.method == "hyperparameters" and not problem.pins:
        alone = continued_alone(solution, problem)
        if not isinstance(alone, Solution):
            return alone
        return replace(alone, unconstrained=solution.unconstrained, alone=solution.alone)
    return learn_jointly(problem)


def _alone(problem: ConstrainedProblem, free: Solution, best: Point | None) -> Solution | NoSolution | None:
    """Return the minimum over θ alone; of many samples only where it is better than the `best` function.

    Each of its programs has a Gram matrix of all samples at each step, and many of them: a search that cannot end below
    a function that is known is given up as soon as that is seen.
    """
    if best is None or sum(map(len, problem.samples)) < _MANY_SAMPLES:
        return best_solution(problem, free=free)
    return better_solution(problem, free, best.objective)


def learn_function(problem: ConstrainedProblem, near: Solution | None = None) -> Solution | NoSolution:
    """Return the function that keeps every bound at all times, for hyperparameters that are all known; or why not.

    `near` is the solution of a problem that differs a little, with other samples or bounds: its places come first.
    Raises ValueError where hyperparameters are to be learned.
    """
    if problem.prior.learned:
        raise ValueError(f"function: hyperparameters have to be known, but {', '.join(problem.prior.learned)}")
    search = JointSearch(problem)
    known, places = problem.prior.log_hyperparameters, near.active if near and near.active_bounds else None
    search.settle(known, places, near.signals if near else None)
    if search.best is not None:
        return _solution(search.best, search.fits, None)
    return NoFunction(problem.pins) if search.closest is None else _no_solution(problem, search.closest)


def _nlml(problem: ConstrainedProblem, log_theta: Array) -> float:
    try:
        return problem.posterior(log_theta).negative_log_marginal_likelihood()[0]
    except IllConditioned:
        return np.inf


def _solution(point: Point, fits: int, unconstrained: JointPosterior | None) -> Solution:
    bent = point.function.bent
    return Solution(
        bent.posterior,
        bent.signals,
        point.objective,
        point.function.places,
        fits,
        active_bounds=bent.active_bounds,
        method="joint",
        unconstrained=unconstrained,
        missed=max(0.0, -point.function.margin),
    )


def _no_solution(problem: ConstrainedProblem, closest: Point) -> NoSolution:
    bent, function = closest.function.bent, closest.function
    if bent.contradicts:
        given_first = sorted(bent.most_influential, key=lambda bound: bound.side != "equal")
        return Contradiction(bent.posterior, tuple(given_first[:_TOLD]))
    quantity = problem.constraints[function.constraint].quantity
    violation = -function.margin * quantity.bounds.width
    return NothingFeasible(bent.posterior, quantity, function.time, violation, problem.broken_at_rest)
