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
