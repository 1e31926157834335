"""The search that suits the kernels."""

from trackable.gp.kernels.periodic import Periodic
from trackable.learning.basins import best_of
from trackable.learning.exchange import solve
from trackable.learning.problem import ConstrainedProblem, NoSolution, Solution
from trackable.learning.screening import screened

_FEWEST_BASINS = 16


def best_solution(problem: ConstrainedProblem) -> Solution | NoSolution:
    """The best of local minima: from starts of the search space, or for periodic kernels from the most promising ones.

    The likelihood of the latter has a basin for nearly every period.
    """
    if all(isinstance(part.kernel, Periodic) for part in problem.prior.parts):
        return best_of(problem, screened(problem, max(_FEWEST_BASINS, problem.space.starts))).outcome
    return solve(problem)
