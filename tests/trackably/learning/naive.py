"""Constrained learning by brute force: every constraint at every step, gradients by finite differences."""

import math
from collections.abc import Iterable
from itertools import product

import numpy as np

from pipeline.published.scalar import coefficients, interval_sets
from tests.trackably.gp import naive
from tests.trackably.learning.instances import Instance
from trackably.gp.prior import Prior
from trackably.systems.constrained import ConstrainedSystem


def states_and_inputs(instance: Instance, prior: Prior) -> tuple[np.ndarray, np.ndarray]:
    """The mean at all constrained steps, and the inputs between them."""
    x = naive.mean(prior, instance.samples, np.arange(instance.last + 1) * instance.plant.sampling_time)
    a, b, c = coefficients(instance.plant)
    return x, (x[1:] - a * x[:-1] - c) / b


def prior_at(instance: Instance, log_theta: Iterable[float]) -> Prior:
    """The prior with these ln θ of its learned hyperparameters."""
    names = instance.prior.learned
    return instance.prior.with_hyperparameters(dict(zip(names, np.exp([*log_theta]).tolist(), strict=True)))


def margins(instance: Instance, prior: Prior) -> np.ndarray:
    """Distances to all bounds at the constrained steps, as parts of their widths."""
    return relative_margins(instance.plant, *states_and_inputs(instance, prior))


def relative_margins(plant: ConstrainedSystem, x: np.ndarray, u: np.ndarray) -> np.ndarray:
    X, U = interval_sets(plant)
    parts = [(x - X.lower) / X.width, (X.upper - x) / X.width, (u - U.lower) / U.width, (U.upper - u) / U.width]
    return np.concatenate(parts)


def best_on_a_grid(instance: Instance) -> float:
    """The smallest objective among feasible points of a grid over the search space, refined around its best."""
    space = instance.problem.space
    low, high = space.log_lower, space.log_upper
    best, at, points = math.inf, (low + high) / 2, 30 if len(low) == 2 else 15
    for _ in range(3):
        for log_theta in product(*np.linspace(low, high, points).T):
            prior = prior_at(instance, log_theta)
            value = naive.negative_log_marginal_likelihood(prior, instance.samples)
            if value < best and np.all(margins(instance, prior) >= 0):
                best, at = value, np.array(log_theta)
        around = 2 * (high - low) / points
        low, high = np.maximum(space.log_lower, at - around), np.minimum(space.log_upper, at + around)
        points = 12
    return best
