"""Evaluate the objective and the constraints on a grid of two hyperparameters."""

from dataclasses import dataclass

import numpy as np

from trackably.arrays import Array
from trackably.gp.posterior import IllConditioned
from trackably.learning.problem import ConstrainedProblem


@dataclass(frozen=True)
class Landscape:
    """l(θ) and the smallest relative margin at each (`theta1[j]`, `theta2[i]`), shapes (len(theta2), len(theta1)).

    The point is feasible where `margin` ≥ 0. Both are NaN where K + σ_n² I cannot be factored.
    """

    theta1: Array
    theta2: Array
    objective: Array
    margin: Array


def landscape(problem: ConstrainedProblem, theta1: Array, theta2: Array) -> Landscape:
    """Evaluate a problem on a grid of its two learned hyperparameters. ValueError unless there are two."""
    if len(problem.prior.learned) != 2:
        raise ValueError(f"a landscape needs two learned hyperparameters, got {', '.join(problem.prior.learned)}")
    values = np.array([[_at(problem, np.log([first, second])) for first in theta1] for second in theta2])
    return Landscape(theta1, theta2, values[..., 0], values[..., 1])


def _at(problem: ConstrainedProblem, log_theta: Array) -> tuple[float, float]:
    posterior = problem.posterior(log_theta)
    try:
        objective, _ = posterior.negative_log_marginal_likelihood()
    except IllConditioned:
        return np.nan, np.nan
    margins = (constraint.closest(posterior)[1] for constraint in problem.constraints)
    return objective, min((float(np.min(margin)) for margin in margins), default=np.inf)
