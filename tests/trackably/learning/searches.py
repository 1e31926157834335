"""Searches from given starts."""

from collections.abc import Iterable

import numpy as np

from trackably.learning.exchange import Exchange
from trackably.learning.problem import ConstrainedProblem, NoSolution, Solution


def followed(problem: ConstrainedProblem, starts: Iterable[np.ndarray]) -> Solution | NoSolution:
    """The best local minimum that the starts lead to, each with places of its own."""
    exchange = Exchange(problem)
    exchange.follow(starts)
    return exchange.outcome


def together(problem: ConstrainedProblem) -> Solution | NoSolution:
    """The best that the starts of the search space lead to, all at once."""
    exchange = Exchange(problem)
    exchange.together(problem.space.start_points())
    return exchange.outcome


def swept(problem: ConstrainedProblem) -> Solution | NoSolution:
    """The best that the starts of the search space lead to, all at once, and again with all places found."""
    exchange = Exchange(problem)
    exchange.together(problem.space.start_points())
    exchange.together(problem.space.start_points())
    return exchange.outcome
