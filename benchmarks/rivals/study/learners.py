"""Our two learners in a study: they start from what the other rivals of the run have found already.

The likelihood's minima are known to all rivals of a run, and the joint search begins with the minimum over θ alone,
which is a rival too. Nothing is sought twice; all else is the library's.
"""

from dataclasses import replace
from functools import lru_cache

from benchmarks.rivals.adapters import fine_grid
from benchmarks.rivals.adapters.ours import Learned, answer, learned
from benchmarks.rivals.model import Answer, Found, Problem
from trackably.certificates.certified import Certified
from trackably.gp.joint import JointPrior
from trackably.learning.exchange import Exchange
from trackably.learning.joint import search as joint
from trackably.learning.learner import HYPERPARAMETERS, JOINT, Learner
from trackably.learning.problem import ConstrainedProblem, NoSolution, Solution, UnmetBounds
from trackably.learning.screening import can_screen

_POINTS = 50  # enough to see that nothing is admissible


def from_starts(problem: ConstrainedProblem) -> Solution | NoSolution:
    """Minimise from the starts of the search space together: where the period is known, there is one basin."""
    exchange = Exchange(problem)
    exchange.together(problem.space.start_points())
    return exchange.outcome


def solve_alone(problem: Problem) -> Answer:
    """Learn θ, with a proof; the reference is a posterior mean."""
    return answer(problem, _alone(problem))


def solve_jointly(problem: Problem) -> Answer:
    """Learn θ and the function, with a proof."""
    alone = _alone(problem)
    found = alone if isinstance(alone, UnmetBounds) else learned(problem, jointly(problem.likeliest, alone))
    return answer(problem, found)


@lru_cache(2)
def _alone(problem: Problem) -> Learned:
    """Both learners of a run need it. Where bounds contradict each other, no posterior mean is looked for."""
    if not isinstance(fine_grid.solve(problem, _POINTS), Found):
        anything = learned(problem, jointly(problem.likeliest, None))
        if isinstance(anything, UnmetBounds):
            return anything
    return learned(problem, hyperparameters(problem.task.prior, problem.likeliest))


def hyperparameters(prior: JointPrior, free: Solution) -> Learner:
    """Return the learner of hyperparameters; for a periodic prior it starts from the likelihood's minima."""
    if not can_screen(prior):
        return HYPERPARAMETERS

    def solve(problem: ConstrainedProblem) -> Solution | NoSolution:
        exchange = Exchange(problem)
        exchange.together([free.posterior.prior.log_hyperparameters, *free.others])
        if exchange.best is None:  # scale the signal down towards rest, and improve what then keeps the bounds
            exchange.keep_scaled_down(problem.space.start_points()[:2])
            exchange.together([exchange.best.log_theta] if exchange.best else [])
        return exchange.outcome

    return replace(HYPERPARAMETERS, solve=solve, extended=lambda _, problem: solve(problem))


def jointly(free: Solution, alone: Learned | None) -> Learner:
    """Return the joint learner that starts from the likelihood's minimum and, where there is one, that over θ alone."""
    known = alone.solution if isinstance(alone, Certified) else None
    starts = [found.posterior.prior.log_hyperparameters for found in (free, known) if found is not None]

    def solve(problem: ConstrainedProblem) -> Solution | NoSolution:
        found = joint.learn_from(starts, problem)
        if known is not None and not (isinstance(found, Solution) and found.objective <= known.objective):
            return known
        return found

    return replace(JOINT, solve=solve, fallback=None)
