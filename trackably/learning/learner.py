"""Learners: how to solve a constrained problem, and how to continue from a solution when the problem has changed."""

from collections.abc import Callable
from dataclasses import dataclass

from trackably.learning.constraint import ROUNDING_BACKOFF
from trackably.learning.joint import search as joint
from trackably.learning.problem import ConstrainedProblem, NoSolution, Solution
from trackably.learning.search import best_solution, continued

Outcome = Solution | NoSolution


@dataclass(frozen=True)
class Learner:
    """The functions that solve constrained problems.

    `solve` needs no earlier solution; `continued` starts from the solution of a problem with other bounds, `extended`
    from the solution of a problem with fewer samples, or with bounds at fewer times. `first_backoff` is the part of a
    bound's width by which bounds are tightened at first. The `fallback` is used if no reference of this learner can be
    proved.
    """

    solve: Callable[[ConstrainedProblem], Outcome]
    continued: Callable[[Solution, ConstrainedProblem], Outcome]
    extended: Callable[[Solution, ConstrainedProblem], Outcome]
    first_backoff: float
    fallback: "Learner | None" = None


HYPERPARAMETERS = Learner(best_solution, continued, lambda _, problem: best_solution(problem), ROUNDING_BACKOFF)
"""Learns the hyperparameters alone, as in the paper: the reference is a posterior mean."""

JOINT = Learner(joint.learn_jointly, joint.continued, joint.extended, first_backoff=1e-6, fallback=HYPERPARAMETERS)
"""Learns the function together with its hyperparameters; if no such reference can be proved, hyperparameters alone."""

FUNCTION = Learner(joint.learn_function, joint.function_near, joint.function_near, first_backoff=1e-6)
"""Learns the function alone; all hyperparameters have to be known. For linear systems, this is a convex program."""
